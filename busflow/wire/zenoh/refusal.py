"""Refusals: what another process says instead of an answer, as the error it was there."""

from __future__ import annotations

import json
from typing import TypeVar

from busflow import errors
from busflow.errors import BusflowError, NoSuchTarget, ServiceError, ServiceFailed, ServiceGone

E = TypeVar("E", bound=BusflowError)


def encode_refusal(error: Exception) -> bytes:
    """An error as it travels: a JSON object with `kind`, the class's name, and `error`, its text."""
    return json.dumps({"kind": type(error).__name__, "error": str(error)}).encode()


def service_refusal(service: str, node: str, reply: bytes) -> ServiceError:
    """The error for what a server's process told; nothing is a server that went without a word."""
    try:
        parsed = json.loads(reply)
        kind, text = str(parsed["kind"]), str(parsed["error"])
    except (ValueError, KeyError, TypeError):
        return ServiceGone(f"{service}: {node} did not answer")
    return _of_kind(kind, ServiceError, ServiceFailed)(text)


def refusal(kind: str, text: str) -> BusflowError:
    """The error of a kind that a run may answer a question with; another kind becomes a plain BusflowError."""
    return _of_kind(kind, NoSuchTarget, BusflowError)(text)


def _of_kind(kind: str, family: type[E], otherwise: type[E]) -> type[E]:
    """The class of this name, where it is one of a family that others may make us raise."""
    found = getattr(errors, kind, None)
    return found if isinstance(found, type) and issubclass(found, family) else otherwise
