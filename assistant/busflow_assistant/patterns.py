"""Patterns of several alternatives, one a line."""

from __future__ import annotations

import re


def either(*alternatives: str) -> re.Pattern[str]:
    """Return a pattern that finds any of the alternatives, in any case.

    >>> bool(either("one", "two").search("TWO"))
    True
    """
    return re.compile("|".join(f"(?:{each})" for each in alternatives), re.IGNORECASE)
