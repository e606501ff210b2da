"""Annotations of a class or function as they are written, in every version of Python. Imports nothing heavy."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Mapping
from typing import Any


def written_annotations(owner: Callable[..., Any]) -> Mapping[str, Any]:
    """Return the annotations of a class's own body, or of a function; the text of what is not known when it is made.

    Since Python 3.14 annotations are evaluated when they are asked for, and the names in them may be defined later.
    """
    if sys.version_info < (3, 14):
        return inspect.get_annotations(owner)
    from annotationlib import Format, ForwardRef, get_annotations

    found = get_annotations(owner, format=Format.FORWARDREF)
    return {name: each.__forward_arg__ if isinstance(each, ForwardRef) else each for name, each in found.items()}
