"""Frames of the page beside those of Foxglove's protocol: its greeting, its questions and their answers. Pure."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, cast

from busflow.commands import finite
from busflow.errors import MalformedMessage

_PREFIX = "busflow/"
_MOST_TEXT = 1 << 20
"""Longest question; a larger one is refused before it is read."""
_MOST_ID = (1 << 53) - 1


@dataclass(frozen=True, slots=True)
class Hello:
    """First message of a page: the token that lets it in."""

    token: str


@dataclass(frozen=True, slots=True)
class Ask:
    """Question, under the page's number."""

    id: int
    question: str
    arguments: Mapping[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True, slots=True)
class Follow:
    """Request to be sent the answer to a question whenever it changes, or no more."""

    question: str
    on: bool


Frame = Hello | Ask | Follow


def read(message: str | bytes) -> Frame | None:
    """Return a frame of the page's own; None for one of Foxglove's protocol.

    Raises:
        MalformedMessage: It is one of the page's, and says nothing that is known.
    """
    if not isinstance(message, str) or _PREFIX not in message:
        return None
    if len(message) > _MOST_TEXT:
        raise MalformedMessage(f"a question has at most {_MOST_TEXT} characters")
    try:
        found = json.loads(message)
    except (ValueError, RecursionError):
        raise MalformedMessage("a text frame is a JSON object") from None
    fields = cast("dict[str, Any]", found) if isinstance(found, dict) else {}
    op = fields.get("op")
    if not isinstance(op, str) or not op.startswith(_PREFIX):
        return None
    match op.removeprefix(_PREFIX), fields:
        case "hello", {"token": str(token)}:
            return Hello(token)
        case "ask", {"id": int(id_), "question": str(question)} if type(id_) is int and 0 <= id_ <= _MOST_ID:
            arguments = fields.get("arguments", {})
            if isinstance(arguments, dict):
                return Ask(id_, question, cast("dict[str, Any]", arguments))
        case "follow", {"question": str(question), "on": bool(on)}:
            return Follow(question, on)
        case _:
            pass
    raise MalformedMessage(f"{op[:100]!r} lacks a field, or has one of another kind")


def answer(id_: int, found: object) -> str:
    """Return the frame with the answer to a question."""
    return _text("answer", id=id_, answer=found)


def part(id_: int, found: object) -> str:
    """Return the frame with a part of an answer that is still to come."""
    return _text("part", id=id_, part=found)


def error(id_: int, sentence: str) -> str:
    """Return the frame that says why a question has no answer."""
    return _text("answer", id=id_, error=sentence)


def update(question: str, found: object) -> str:
    """Return the frame with the answer to a question that is followed."""
    return _text("update", question=question, answer=found)


def _text(op: str, **fields: Any) -> str:
    return json.dumps({"op": f"{_PREFIX}{op}", **finite(fields)}, separators=(",", ":"), allow_nan=False)
