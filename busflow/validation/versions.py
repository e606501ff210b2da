"""Versions of busflow: what a launch file asks for, which of them work together, and how a deprecation is announced."""

from __future__ import annotations

import sys
import warnings


def check_requirement(text: str) -> str:
    """Return a launch file's `busflow:`, such as `>=0.1,<0.3`, if this version is one of those.

    Raises:
        ValueError: It is not, or the text names no versions.
    """
    from packaging.specifiers import InvalidSpecifier, SpecifierSet  # only for a file that states versions

    import busflow

    try:
        fits = SpecifierSet(text).contains(busflow.__version__, prereleases=True)
    except InvalidSpecifier:
        raise ValueError(f"{text!r} names no versions; write one like '>=0.1' or '>=0.1,<0.3'") from None
    if not fits:
        raise ValueError(f"the file needs busflow {text}, and this is {busflow.__version__}; install one that fits")
    return text


def work_together(one: str, other: str) -> bool:
    """Return whether processes of two versions understand each other: before 1.0, those of one minor version.

    >>> work_together("0.1.0", "0.1.7"), work_together("0.1.0", "0.2.0"), work_together("1.2.0", "1.5.1")
    (True, False, True)
    """
    numbers = (one.split(".")[:2], other.split(".")[:2])
    return numbers[0] == numbers[1] or (numbers[0][0] == numbers[1][0] != "0")


def warn_of(what: str, *, instead: str, gone_in: str) -> None:
    """Warn, at the line outside of busflow that uses it, of something that a later version will not have any more.

    Args:
        what: what is deprecated, as the subject of a sentence.
        instead: what to write.
        gone_in: the first version without it.
    """
    level, frame = 1, sys._getframe()  # noqa: SLF001  # `skip_file_prefixes` is there from Python 3.12 on
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "busflow":
        level, frame = level + 1, frame.f_back
    warnings.warn(
        f"{what} is deprecated and gone in busflow {gone_in}: {instead}", DeprecationWarning, stacklevel=level
    )
