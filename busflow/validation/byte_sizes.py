"""Sizes in text form: `64MiB`, `1.5 GB`, or a plain number of bytes."""

from __future__ import annotations

import re

from busflow.text import printable

_UNITS = {"B": 1, "kB": 10**3, "MB": 10**6, "GB": 10**9, "KiB": 1 << 10, "MiB": 1 << 20, "GiB": 1 << 30}
_MOST = 1 << 50
PATTERN = r"[0-9]+(\.[0-9]+)? *(B|kB|MB|GB|KiB|MiB|GiB)"
_TEXT = re.compile(PATTERN)


def parse_size(value: object) -> int:
    """Return a size in bytes.

    >>> parse_size("64MiB"), parse_size("1.5 kB"), parse_size(4096)
    (67108864, 1500, 4096)

    Raises:
        ValueError: It is not a size.
    """
    size: float = 0
    if isinstance(value, int) and not isinstance(value, bool):
        size = value
    elif isinstance(value, str) and len(value) < 40 and (found := _TEXT.fullmatch(value.strip())):
        unit = found[2]
        size = float(value.strip().removesuffix(unit)) * _UNITS[unit]
    if not 1 <= size <= _MOST:
        got = printable(repr(value), limit=60)
        raise ValueError(f"a size is a number of bytes or a text such as 64MiB, 1.5GB or 500kB, got {got}")
    return int(size)
