"""Durations in text form: `50ms`, `1.5s`, `10min`, or a plain number of seconds."""

from __future__ import annotations

import math
import re

from busflow.text import printable

UNITS_NS = {"ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9, "min": 60 * 10**9, "h": 3600 * 10**9}
"""The nanoseconds of each unit."""
_LONGEST_NS = 2**63 - 1
PATTERN = r"[0-9]+(\.[0-9]+)? *(ns|us|ms|s|min|h)"
_TEXT = re.compile(PATTERN)


def parse_duration(value: object) -> float:
    """Return a duration in seconds, rounded to nanoseconds. Infinity stays infinite.

    >>> parse_duration("50ms"), parse_duration("1.5 h"), parse_duration(2)
    (0.05, 5400.0, 2.0)

    Raises:
        ValueError: It is not a duration, or not a positive one that ROS 2 can express.
    """
    seconds = math.nan
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        seconds = float(value)
    elif isinstance(value, str) and len(value) < 40 and (found := _TEXT.fullmatch(value.strip())):
        unit = found[2]
        seconds = float(value.strip().removesuffix(unit)) * UNITS_NS[unit] / 10**9
    if math.isnan(seconds):
        got = printable(repr(value), limit=60)
        raise ValueError(f"a duration is a number of seconds or a text such as 50ms, 1.5s or 10min, got {got}")
    if seconds == math.inf:
        return seconds
    if not 0.5e-9 < seconds <= _LONGEST_NS / 10**9:
        raise ValueError(f"a duration is at least 1 ns and at most 292 years, got {value}")
    return round(seconds * 10**9) / 10**9


def show_duration(seconds: float) -> str:
    """Return a duration in the largest unit below a minute in which it is a whole number.

    >>> show_duration(0.05), show_duration(120), show_duration(1.000000001)
    ('50ms', '120s', '1000000001ns')
    """
    if math.isinf(seconds):
        return ".inf"
    ns = round(seconds * 10**9)
    unit = next(unit for unit in ("s", "ms", "us", "ns") if ns % UNITS_NS[unit] == 0)
    return f"{ns // UNITS_NS[unit]}{unit}"
