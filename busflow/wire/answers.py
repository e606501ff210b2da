"""Answers: what a run tells whoever asks it, over Zenoh queries.

A question is a query on `@busflow/1/<process>/<question>` with its arguments as a JSON object. The answer is one reply,
a JSON object: `{"answer": …}`, or `{"error": …, "kind": …}` for what cannot be answered. Messages that are kept are
replied as they travel, one reply each, before it. The number in the key is the version of all this.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import zenoh

from busflow.errors import BusflowError

if TYPE_CHECKING:
    from busflow.wire.sender import Sender

PREFIX = "@busflow/1"
_ARGUMENT_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class WithMessages:
    """An answer, and the messages that belong to it, each with its attachment."""

    answer: object
    messages: Sequence[tuple[bytes, bytes]]


Question = Callable[[Mapping[str, Any]], object]
"""What answers a question, on the event loop: its arguments in, what can become JSON out."""


class Answers:
    """Answers the questions of other processes."""

    def __init__(
        self,
        session: zenoh.Session,
        process: str,
        questions: Mapping[str, Question],
        *,
        sender: Sender,
        on_loop: Callable[..., None],
    ) -> None:
        """Begin to answer; `on_loop` runs a function on the event loop, from any thread."""
        self._questions, self._sender = questions, sender

        def hear(query: zenoh.Query) -> None:
            on_loop(self._answer, query)

        key = f"{PREFIX}/{process}/*"
        self._way = session.declare_queryable(key, zenoh.handlers.Callback(hear, indirect=False))

    def close(self) -> None:
        """Answer no more."""
        self._way.undeclare()

    def _answer(self, query: zenoh.Query) -> None:
        # The reply leaves through the sender: a link whose reader has stopped would hold up the loop.
        messages, text = self._told(query)
        key = str(self._way.key_expr).removesuffix("*") + str(query.key_expr).rpartition("/")[2]
        self._sender.hand(self, partial(_reply, query, key, messages, text))

    def _told(self, query: zenoh.Query) -> tuple[Sequence[tuple[bytes, bytes]], str]:
        try:
            name = str(query.key_expr).rpartition("/")[2]
            found = self._questions[name](_arguments(query))
            answer = found if isinstance(found, WithMessages) else WithMessages(found, ())
            return answer.messages, json.dumps({"answer": answer.answer}, default=str)
        except (BusflowError, ValueError, LookupError, TypeError) as error:
            return (), json.dumps({"error": str(error), "kind": type(error).__name__})


def _arguments(query: zenoh.Query) -> Mapping[str, Any]:
    payload = query.payload
    if payload is None:
        return {}
    if len(payload) > _ARGUMENT_BYTES:
        raise ValueError(f"the question has {len(payload)} bytes; at most {_ARGUMENT_BYTES} are read")
    found = json.loads(payload.to_bytes())
    if not isinstance(found, dict):
        raise TypeError("a question's arguments are a JSON object")
    return cast("Mapping[str, Any]", found)


def _reply(query: zenoh.Query, key: str, messages: Sequence[tuple[bytes, bytes]], text: str) -> None:
    try:
        for payload, attachment in messages:
            query.reply(key, payload, attachment=attachment)
        query.reply(key, text.encode())
    except zenoh.ZError:
        pass  # who asked has gone
    finally:
        query.drop()
