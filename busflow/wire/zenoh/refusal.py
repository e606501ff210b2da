"""Refusals: encodes an error for another process, which raises it again as an error of the same class."""

from __future__ import annotations

import json
from typing import TypeVar

from busflow import errors
from busflow.errors import BusflowError, NoSuchTarget, ServiceError, ServiceFailed, ServiceGone

E = TypeVar("E", bound=BusflowError)


def encode_refusal(error: Exception) -> bytes:
    """Encode an error as a JSON object with `kind`, the class's name, and `error`, its text."""
    return json.dumps({"kind": type(error).__name__, "error": str(error)}).encode()


def service_refusal(service: str, node: str, reply: bytes) -> ServiceError:
    """Return the error in a server's reply; an empty reply means that the server has gone."""
    try:
        parsed = json.loads(reply)
        kind, text = str(parsed["kind"]), str(parsed["error"])
    except (ValueError, KeyError, TypeError):
        return ServiceGone(f"{service}: {node} did not answer")
    return _of_kind(kind, ServiceError, ServiceFailed)(text)


def refusal(kind: str, text: str) -> BusflowError:
    """Return the error of this kind; a kind that is not a `NoSuchTarget` becomes a plain BusflowError."""
    return _of_kind(kind, NoSuchTarget, BusflowError)(text)


def _of_kind(kind: str, family: type[E], otherwise: type[E]) -> type[E]:
    """Return the error class of this name if it derives from `family`, else `otherwise`."""
    found = getattr(errors, kind, None)
    return found if isinstance(found, type) and issubclass(found, family) else otherwise
