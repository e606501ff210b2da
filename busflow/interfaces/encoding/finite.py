"""Numbers that JSON cannot write: infinity and NaN become text."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, cast


def finite(data: Any) -> Any:
    """The data with infinity and NaN as the text that a launch file has for them: JSON has no such numbers.

    >>> finite({"range": [1.0, float("-inf")]})
    {'range': [1.0, '-.inf']}
    """
    match data:
        case float() if not math.isfinite(data):
            return ".nan" if math.isnan(data) else f"{'-' * (data < 0)}.inf"
        case Mapping():
            return {str(key): finite(each) for key, each in cast("Mapping[object, object]", data).items()}
        case list() | tuple():
            return [finite(each) for each in cast("Sequence[object]", data)]
        case _:
            return data
