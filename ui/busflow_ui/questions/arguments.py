"""Arguments of questions, checked: they come from a browser, and may be anything. Pure."""

from __future__ import annotations

from base64 import b64decode
from collections.abc import Mapping
from typing import Any, cast

from busflow.errors import MalformedMessage

_MOST_DIGITS = 19


def text(arguments: Mapping[str, Any], word: str) -> str:
    """Return a text.

    Raises:
        MalformedMessage: It is missing, or something else.
    """
    found = arguments.get(word)
    if not isinstance(found, str):
        raise MalformedMessage(f"{word} is text")
    return found


def encoded(arguments: Mapping[str, Any], word: str) -> bytes:
    """Return bytes, which are written as base64.

    Raises:
        MalformedMessage: They are missing, or something else.
    """
    try:
        return b64decode(text(arguments, word), validate=True)
    except ValueError:
        raise MalformedMessage(f"{word} is base64") from None


def texts(arguments: Mapping[str, Any], word: str) -> list[str] | None:
    """Return a list of texts; None where it is not stated.

    Raises:
        MalformedMessage: It is something else.
    """
    found = arguments.get(word)
    if found is None:
        return None
    if not isinstance(found, list) or not all(isinstance(each, str) for each in cast("list[object]", found)):
        raise MalformedMessage(f"{word} is a list of texts")
    return cast("list[str]", found)


def mapping(arguments: Mapping[str, Any], word: str) -> Mapping[str, Any]:
    """Return an object.

    Raises:
        MalformedMessage: It is missing, or something else.
    """
    found = arguments.get(word)
    if not isinstance(found, dict):
        raise MalformedMessage(f"{word} is an object")
    return cast("dict[str, Any]", found)


def flag(arguments: Mapping[str, Any], word: str) -> bool:
    """Return true or false.

    Raises:
        MalformedMessage: It is missing, or something else.
    """
    found = arguments.get(word)
    if not isinstance(found, bool):
        raise MalformedMessage(f"{word} is true or false")
    return found


def whole_number(arguments: Mapping[str, Any], word: str, *, least: int, most: int, default: int | None = None) -> int:
    """Return a whole number within bounds.

    Raises:
        MalformedMessage: It is missing and has no default, or something else.
    """
    found = arguments.get(word, default)
    if type(found) is not int or not least <= found <= most:
        raise MalformedMessage(f"{word} is a whole number from {least} to {most}")
    return found


def digits(arguments: Mapping[str, Any], word: str) -> int:
    """Return a moment in nanoseconds: text of digits, since numbers of a browser lose some, or a number.

    Raises:
        MalformedMessage: It is missing, or something else.
    """
    found = arguments.get(word)
    if isinstance(found, str) and found.isascii() and found.isdigit() and len(found) <= _MOST_DIGITS:
        return int(found)
    if type(found) is int and 0 <= found < 10**_MOST_DIGITS:
        return found
    raise MalformedMessage(f"{word} is a moment in nanoseconds, written with digits")


def number(arguments: Mapping[str, Any], word: str, *, above: float, most: float, default: float) -> float:
    """Return a number within bounds.

    Raises:
        MalformedMessage: It is something else.
    """
    found = arguments.get(word, default)
    if type(found) not in (int, float) or not above < found <= most:
        raise MalformedMessage(f"{word} is a number above {above:g}, at most {most:g}")
    return float(found)


def one_of(arguments: Mapping[str, Any], word: str, choices: tuple[str, ...]) -> str:
    """Return one of some words.

    Raises:
        MalformedMessage: It is missing, or another one.
    """
    found = arguments.get(word)
    if not isinstance(found, str) or found not in choices:
        raise MalformedMessage(f"{word} is one of {', '.join(choices)}")
    return found
