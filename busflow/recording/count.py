"""Counts as people say them."""

from __future__ import annotations


def counted(count: int, one: str, several: str = "") -> str:
    """So many of something, as people say it; `several` is `one` with an s unless told.

    >>> counted(1, "message"), counted(0, "message"), counted(2, "entry", "entries")
    ('1 message', '0 messages', '2 entries')
    """
    return f"{count} {one if count == 1 else several or f'{one}s'}"
