"""QuestionServer: answers the questions of clients, over Zenoh queries.

A question is a query on `@busflow/1/<process>/<question>` with its arguments as a JSON object. The answer is one reply,
a JSON object: `{"answer": …}`, or `{"error": …, "kind": …}` if the question cannot be answered. Kept messages come
before it in their wire encoding, one reply each. The number in the key is the version of this protocol.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import zenoh

from busflow.errors import BusflowError
from busflow.text import did_you_mean, printable
from busflow.wire.zenoh.keys import QUERY_PREFIX
from busflow.wire.zenoh.refusal import encode_refusal

if TYPE_CHECKING:
    from busflow.log import Logger
    from busflow.wire.zenoh.sender import SenderThread

_ARGUMENT_BYTES = 1 << 20
_MOST_WAITING = 64
"""Limit of the questions that wait for the event loop. Further ones are dropped without an answer, which limits a
client that queries a blocked run again and again.
"""


@dataclass(frozen=True, slots=True)
class WithMessages:
    """An answer and its messages, each with its attachment."""

    answer: object
    messages: Sequence[tuple[bytes, bytes]]


Question = Callable[[Mapping[str, Any]], object]
"""A function that answers a question on the event loop: arguments in, JSON-compatible data out."""


class QuestionServer:
    """Answers the questions of other processes."""

    def __init__(
        self,
        session: zenoh.Session,
        process: str,
        questions: Mapping[str, Question],
        *,
        sender: SenderThread,
        log: Logger,
        on_loop: Callable[..., None],
    ) -> None:
        """Start to answer; `on_loop` runs a function on the event loop, from any thread."""
        self._questions, self._sender, self._log, self._on_loop = questions, sender, log, on_loop
        self._room = threading.Semaphore(_MOST_WAITING)
        self._key = f"{QUERY_PREFIX}/{process}/"
        self._way = session.declare_queryable(f"{self._key}*", zenoh.handlers.Callback(self._on_query, indirect=False))

    def close(self) -> None:
        """Stop answering."""
        self._way.undeclare()

    def _on_query(self, query: zenoh.Query) -> None:
        """Pass a question to the event loop; called in Zenoh's thread."""
        if self._room.acquire(blocking=False):
            self._on_loop(self._answer, query)
        else:
            query.drop()

    def _answer(self, query: zenoh.Query) -> None:
        self._room.release()
        # The reply leaves through the sender: a link whose reader has stopped would hold up the loop.
        name = str(query.key_expr).rpartition("/")[2]
        messages, answer = self._result(name, query)
        size = len(answer) + sum(len(payload) for payload, _ in messages)
        self._sender.hand(partial(_reply, query, self._key + name, messages, answer), size)

    def _result(self, name: str, query: zenoh.Query) -> tuple[Sequence[tuple[bytes, bytes]], bytes]:
        try:
            found = self._question(name)(_arguments(query))
            answer = found if isinstance(found, WithMessages) else WithMessages(found, ())
            return answer.messages, json.dumps({"answer": answer.answer}, default=str).encode()
        except KeyError as error:
            return (), encode_refusal(ValueError(f"{name} needs the argument {error}"))
        except (BusflowError, ValueError, LookupError, TypeError, ArithmeticError, RecursionError) as error:
            return (), encode_refusal(error)
        except Exception as error:  # noqa: BLE001  # a question must not end a run, and both sides get the error
            self._log.error(f"the question {printable(name)} was not answered", exc_info=error)
            return (), encode_refusal(error)

    def _question(self, name: str) -> Question:
        found = self._questions.get(name)
        if found is None:
            raise ValueError(f"there is no question {printable(name)!r}; {did_you_mean(name, self._questions)}")
        return found


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


def _reply(query: zenoh.Query, key: str, messages: Sequence[tuple[bytes, bytes]], answer: bytes) -> None:
    with replying(query):
        for payload, attachment in messages:
            query.reply(key, payload, attachment=attachment)
        query.reply(key, answer)


@contextmanager
def replying(query: zenoh.Query) -> Generator[None]:
    """Reply to a query inside the block, and drop the query after it; errors of a client that has gone are ignored."""
    try:
        yield
    except zenoh.ZError:
        pass
    finally:
        query.drop()
