"""Peer: a process that joins a run to look, act and leave again. It imports none of the run's code.

It opens no socket of its own, and reads messages by the descriptions that the run offers.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import json
import os
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import zenoh
import zenoh.ext

from busflow.errors import BusflowError, InspectionUnavailable, MalformedMessage, NoSuchTarget, ServiceTimeout
from busflow.wire.answers import PREFIX
from busflow.wire.keys import DOMAIN, GRAPH, Attachment, Kind, Token, topic_key
from busflow.wire.listener import Listener, Received
from busflow.wire.qos_form import from_text
from busflow.wire.refusal import refusal, service_refusal
from busflow.wire.run_directory import FoundRun, find_run, runs
from busflow.wire.session import open_session
from busflow.wire.speaker import Speaker
from busflow.wire.view import GraphView, TopicView, view

if TYPE_CHECKING:
    from busflow.wire.foreign import ForeignType

ANSWER_TIMEOUT_S = 5.0
_TIMED_OUT = b"Timeout"
"""Zenoh's own error reply."""
_DEFAULT_QOS = "::,10:,:,:,,"
_LATCHED = "transient_local"
_LATCHED_QOS = ":1:,10:,:,:,,"


@dataclass(frozen=True, slots=True)
class ServiceKind:
    """A service, and what is needed to ask it."""

    name: str
    type: str
    hash: str
    request: ForeignType
    response: ForeignType


class Peer:
    """A member of a run that only looks and acts."""

    def __init__(self, run: FoundRun, *, patience_s: float = ANSWER_TIMEOUT_S) -> None:
        """Join a run; use `join`, which leaves it again.

        Args:
            run: the run.
            patience_s: how long to wait for an answer, also for the first one.

        Raises:
            InspectionUnavailable: nobody answers there.
        """
        self.run = run
        self.session = open_session(run.directory, patience_s=patience_s)
        self._patience_s = patience_s
        self._zid = str(self.session.info.zid())
        self._name = f"_busflow_cli_{os.getpid()}"
        self._ids = 0
        self._tokens: list[zenoh.LivelinessToken] = []
        self._types: dict[str, ForeignType] = {}

    def close(self) -> None:
        """Leave the run. Without it the interpreter would wait for ever for Zenoh's threads."""
        self.session.close()

    @property
    def alive(self) -> bool:
        """Whether the run is still there."""
        return self.run in runs()

    # Asking.

    def ask(self, question: str, **arguments: Any) -> list[Any]:
        """The answer of every process of the run.

        Raises:
            NoSuchTarget: none of them knows what is asked for.
            InspectionUnavailable: none answers in time: the run's event loop is blocked, or it has just ended.
        """
        return [answer for answer, _ in self.ask_for_messages(question, **arguments)]

    def ask_for_messages(self, question: str, **arguments: Any) -> list[tuple[Any, list[Received]]]:
        """As `ask`; with each answer the messages that came before it."""
        replies = self.session.get(
            f"{PREFIX}/*/{question}",
            payload=json.dumps(arguments),
            congestion_control=zenoh.CongestionControl.DROP,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=self._patience_s,
        )
        messages: dict[str, list[Received]] = {}
        found: list[tuple[Any, list[Received]]] = []
        refusals: list[BusflowError] = []
        for reply in replies:
            if reply.ok is None:
                continue
            who = str(reply.ok.key_expr)
            if reply.ok.attachment is not None:
                messages.setdefault(who, []).append(Received.of(reply.ok))
                continue
            told = _told(reply.ok.payload.to_bytes())
            if "answer" in told:
                found.append((told["answer"], messages.pop(who, [])))
            else:
                refusals.append(refusal(str(told.get("kind")), str(told.get("error"))))
        if not found:
            raise (
                refusals[0]
                if refusals
                else InspectionUnavailable(
                    f"{self.run.name} does not answer: it has just ended, or a handler blocks its event loop"
                )
            )
        return found

    def tokens(self) -> list[Token]:
        """Every node and endpoint of the run, this peer's own left out."""
        found: list[Token] = []
        for reply in self.session.liveliness().get(f"{GRAPH}/{DOMAIN}/**", timeout=self._patience_s):
            with suppress(MalformedMessage):  # somebody else's idea of a token is no reason to show nothing
                if reply.ok is not None:
                    found.append(Token.parse(str(reply.ok.key_expr)))
        return [token for token in found if token.session != self._zid]

    def graph(self) -> GraphView:
        """The run's nodes and topics as they are now."""
        return view(*self.look())

    def look(self) -> tuple[list[Token], list[Any]]:
        """What a view of the graph is made of: every token, and each process's answer to `graph`.

        Those of others that only look are told by the run's processes: they have no link to this one.
        """
        tokens, answers = {str(token): token for token in self.tokens()}, self.ask("graph")
        for text in {text for answer in answers for text in answer.get("elsewhere", ())} - tokens.keys():
            token = Token.parse(text)
            if token.session != self._zid:
                tokens[text] = token
        return list(tokens.values()), answers

    def type(self, name: str) -> ForeignType:
        """A message type that the run uses, ready to read and write its messages.

        Raises:
            NoSuchTarget: no topic of the run has this type.
            MalformedMessage: the description that is offered is not the one its hash stands for.
        """
        from busflow.wire.foreign import ForeignType  # whoever reads no message does not pay for the codec

        if name not in self._types:
            for answer in self.ask("types", names=[name]):
                for told in answer.values():
                    self._types[name] = ForeignType(name, told["hash"], told["description"])
        if name not in self._types:
            raise NoSuchTarget(f"the run does not say what {name} is")
        return self._types[name]

    # Listening and publishing.

    @contextmanager
    def listen(self, topic: TopicView, type_: ForeignType | None = None, *, depth: int = 1000) -> Generator[Listener]:
        """Receive a topic while the block lasts; of more than `depth` that wait, the oldest are lost.

        What transient_local publishers keep for late joiners comes first.
        """
        type_ = type_ or self.type(topic.types[0])
        latched = any(end.qos.durability == _LATCHED for end in topic.publishers)
        with self._present(Kind.SUBSCRIPTION, topic.name, type_, _LATCHED_QOS if latched else _DEFAULT_QOS):
            listener = Listener(depth)
            key = topic_key(topic.name, type_.name, type_.type_hash)
            callback: Any = zenoh.handlers.Callback(listener.put, indirect=False)
            history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=depth)
            way: Any = (
                zenoh.ext.declare_advanced_subscriber(self.session, key, callback, history=history)
                if latched
                else self.session.declare_subscriber(key, callback)
            )
            try:
                yield listener
            finally:
                way.undeclare()

    @contextmanager
    def advertise(self, topic: str, type_: ForeignType, *, qos: str = _DEFAULT_QOS) -> Generator[Speaker]:
        """Publish a topic while the block lasts; `qos` in the form of `qos_form.to_text`."""
        from busflow.clock import SystemClock  # whoever only looks does not pay for asyncio

        told = from_text(qos)
        with self._present(Kind.PUBLISHER, topic, type_, qos) as token:
            key = topic_key(topic, type_.name, type_.type_hash)
            drop = zenoh.CongestionControl.DROP
            cache = zenoh.ext.CacheConfig(max_samples=told.depth)
            numbered = zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None)
            way: Any = (
                zenoh.ext.declare_advanced_publisher(
                    self.session,
                    key,
                    cache=cache,
                    sample_miss_detection=numbered,
                    publisher_detection=True,
                    congestion_control=drop,
                )
                if told.durability == _LATCHED
                else self.session.declare_publisher(key, congestion_control=drop)
            )
            beside = self.session.declare_publisher(key)  # a publisher that keeps does not tell who listens
            try:
                yield Speaker(way, beside, type_, token.gid, SystemClock())
            finally:
                way.undeclare()
                beside.undeclare()

    def service(self, name: str) -> ServiceKind:
        """What a service of the run takes and gives.

        Raises:
            NoSuchTarget: no process of the run says what it is.
        """
        from busflow.wire.foreign import ForeignType

        for answer in self.ask("services", names=[name]):
            for told in answer.values():
                request, response = (
                    ForeignType(f"{told['type']}_{part}", told[part.lower()]["hash"], told[part.lower()]["description"])
                    for part in ("Request", "Response")
                )
                return ServiceKind(name, told["type"], told["hash"], request, response)
        raise NoSuchTarget(f"the run does not say what the service {name} takes")

    def call(self, service: ServiceKind, values: Mapping[str, Any], *, timeout_s: float) -> Any:
        """Ask a service; the answer as plain values.

        Raises:
            MalformedMessage: a value of the request does not fit, or the answer is none.
            ServiceError: there is no answer, for one of its reasons.
        """
        payload = service.request.encode(values)
        replies = self.session.get(
            f"{topic_key(service.name, service.type, service.hash)}?timeout={timeout_s}",
            payload=payload,
            attachment=Attachment(1, 0, bytes(16)).encode(),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout_s,
        )
        refused = None
        for reply in replies:
            if reply.ok is not None:
                return service.response.decode(reply.ok.payload.to_bytes())
            if reply.err is not None:
                refused = refused or reply.err.payload.to_bytes()
        if refused == _TIMED_OUT:
            raise ServiceTimeout(f"{service.name} did not answer within {timeout_s:g} s")
        raise service_refusal(service.name, "its server", refused or b"")

    @contextmanager
    def _present(self, kind: Kind, topic: str, type_: ForeignType, qos: str) -> Generator[Token]:
        """Be a node with one end, as the others see it."""
        self._ids += 1
        node = Token(self._zid, 0, 0, Kind.NODE, "/", self._name)
        end = Token(self._zid, 0, self._ids, kind, "/", self._name, topic, type_.name, type_.type_hash, qos)
        liveliness = self.session.liveliness()
        with liveliness.declare_token(str(node)), liveliness.declare_token(str(end)):
            yield end


@contextmanager
def join(name: str | None = None, *, patience_s: float = ANSWER_TIMEOUT_S) -> Generator[Peer]:
    """Be a member of a run while the block lasts; without a name, of the only one there is.

    It waits for `patience_s` at most for each answer.

    Raises:
        NoSuchRun: there is none, or it has to be said which.
        InspectionUnavailable: it does not answer.
    """
    peer = Peer(find_run(name), patience_s=patience_s)
    try:
        yield peer
    finally:
        peer.close()


def _told(payload: bytes) -> dict[str, Any]:
    """What a process answered; a refusal where that is no answer."""
    try:
        found = json.loads(payload)
    except (ValueError, RecursionError):
        found = None
    return (
        found if isinstance(found, dict) else {"kind": "", "error": "a process of the run gave an answer that is none"}
    )
