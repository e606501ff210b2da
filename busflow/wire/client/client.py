"""Peer: a process that joins a run to look, act and leave again. It imports none of the run's code.

It opens no socket of its own, and reads messages by the descriptions that the run offers.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import json
import os
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from itertools import count
from typing import TYPE_CHECKING, Any

import zenoh
import zenoh.ext

from busflow import timeouts
from busflow.errors import (
    BusflowError,
    InspectionUnavailable,
    MalformedMessage,
    NoSuchTarget,
    RunEnded,
    ServiceTimeout,
)
from busflow.text import printable
from busflow.wire.client.graph_view import GraphView, TopicView, view
from busflow.wire.client.listener import MOST_BYTES, Listener, Received
from busflow.wire.client.speaker import Speaker, speaking
from busflow.wire.zenoh.keys import (
    ATTACHMENT_BYTES,
    GRAPH,
    HUMBLE,
    PATIENCE,
    QUERY_PREFIX,
    READ_ONLY_QUERIES,
    REMARKS,
    Attachment,
    Token,
    TokenKind,
    topic_key,
)
from busflow.wire.zenoh.refusal import refusal, service_refusal
from busflow.wire.zenoh.run_directory import AT, FoundRun, find_run

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.wire.machines.remote import RemoteRun

_TIMED_OUT = b"Timeout"
"""Zenoh's own error reply."""
_DESCRIPTIONS = "type_description_interfaces/srv/GetTypeDescription"
_DEFAULT_QOS = "::,10:,:,:,,"
_LEAST_QOS = "2::,10:,:,:,,"
"""Best effort and volatile: what every publisher offers, also one that comes later."""


@dataclass(frozen=True, slots=True)
class ServiceKind:
    """A service and the types needed to call it."""

    name: str
    type: str
    hash: str
    request: ForeignType
    response: ForeignType
    event: ForeignType | None = None
    """The type of the messages in which its calls are published, if it was asked for; None where they are not."""


class Peer:
    """A client of a run."""

    def __init__(self, run: FoundRun | RemoteRun, *, patience_s: float | None = None) -> None:
        """Join a run; use `join`, which leaves it again.

        Args:
            run: the run.
            patience_s: how long to wait for an answer, also for the first one; None for the usual time.

        Raises:
            InspectionUnavailable: no process answers there.
        """
        self.run = run
        self.silence: str = ""
        """Why the main process has not answered the last question, while others of the run have; else empty."""
        self.on_silence: Callable[[str], object] = lambda _text: None
        """Called with this text when the main process falls silent."""
        self._patience_s = timeouts.current.answer if patience_s is None else patience_s
        self.session: zenoh.Session = run.open(self._patience_s)
        self._zid = str(self.session.info.zid())
        self._name = f"_busflow_cli_{os.getpid()}"
        self._ids = count(1)  # whose next is one step, so that ends may begin in several threads
        self._tokens: list[zenoh.LivelinessToken] = []
        self._types: dict[tuple[str, str | None], ForeignType] = {}

    def close(self) -> None:
        """Leave the run. Without it the interpreter would wait for ever for Zenoh's threads."""
        self.session.close()

    @property
    def domain(self) -> int:
        """The domain in the keys of the run."""
        return self.run.card.domain

    def keys(self, topic: str, type_: ForeignType) -> list[str]:
        """Return the keys of a topic's messages: with nodes of ROS 2 also that of Humble."""
        hashes = [type_.type_hash] if self.run.card.ros2_domain is None else [type_.type_hash, HUMBLE]
        return [topic_key(topic, type_.name, each, domain=self.domain) for each in hashes]

    def key(self, service: ServiceKind) -> str:
        """Return the key of a service's requests."""
        return topic_key(service.name, service.type, service.hash, domain=self.domain)

    @property
    def alive(self) -> bool:
        """Whether the run still exists."""
        return self.run.is_alive(self.session)

    def require_run(self) -> None:
        """Check that the run still exists.

        Raises:
            RunEnded: it does not.
        """
        if not self.alive:
            raise RunEnded(f"the run {printable(self.run.name)} has ended")

    def require(self, what: str) -> None:
        """Check that this client may do more than look.

        Raises:
            NotAllowed: it may not; the run would not answer.
        """
        self.run.require(what)

    # Asking.

    def ask(self, question: str, **arguments: Any) -> list[Any]:
        """Return the answer of every process of the run.

        Raises:
            NoSuchTarget: none of them knows what is asked for.
            RunEnded: the run has ended.
            InspectionUnavailable: none answers in time: the run's event loop is blocked, or it has just ended.
        """
        return [answer for answer, _ in self.ask_for_messages(question, **arguments)]

    def ask_for_messages(self, question: str, **arguments: Any) -> list[tuple[Any, list[Received]]]:
        """Ask as `ask` does; return with each answer the messages that came before it."""
        if question not in READ_ONLY_QUERIES:
            self.require(question.replace("_", " "))
        messages: dict[str, list[Received]] = {}
        found: list[tuple[Any, list[Received]]] = []
        refusals: list[BusflowError] = []
        silent = self.run.card.main_process
        for reply in self._replies(question, arguments, self._patience_s):
            if reply.ok is None:
                continue
            process = str(reply.ok.key_expr)
            silent = "" if process.endswith(f"/{silent}/{question}") else silent
            if reply.ok.attachment is not None:
                messages.setdefault(process, []).append(Received.of(reply.ok))
                continue
            answer = _parsed(reply.ok.payload.to_bytes())
            if "answer" in answer:
                found.append((answer["answer"], messages.pop(process, [])))
            else:
                refusals.append(refusal(str(answer.get("kind")), str(answer.get("error"))))
        self._note_silence(is_silent=bool(silent and (found or refusals)))
        if refusals and not found:
            raise refusals[0]
        if not found:
            self.require_run()
            raise InspectionUnavailable(
                f"{printable(self.run.name)} does not answer: it has just ended, or a handler blocks its event loop"
            )
        return found

    def _note_silence(self, *, is_silent: bool) -> None:
        former, why = self.silence, "it is stopped, or a handler blocks its event loop"
        self.silence = f"the main process of {printable(self.run.name)} does not answer: {why}" if is_silent else ""
        if is_silent and not former:
            self.on_silence(self.silence)

    def tokens(self) -> list[Token]:
        """Return the tokens of every node and endpoint of the run, without this client's own."""
        found: list[Token] = []
        for reply in self.session.liveliness().get(f"{GRAPH}/{self.domain}/**", timeout=self._patience_s):
            with suppress(MalformedMessage):  # a foreign session's malformed token must not hide the rest
                if reply.ok is not None:
                    found.append(Token.parse(str(reply.ok.key_expr)))
        return [token for token in found if token.session != self._zid]

    def processes(self) -> Mapping[str, str]:
        """Return the name of each process by its session; a run in one process has none."""
        found: dict[str, str] = {}
        for reply in self.session.liveliness().get(f"{QUERY_PREFIX}/*/shown/*/*", timeout=self._patience_s):
            if reply.ok is not None:
                process, _, session, _ = str(reply.ok.key_expr).removeprefix(f"{QUERY_PREFIX}/").split("/")
                found[session] = process
        return found

    def graph(self) -> GraphView:
        """Return the run's nodes and topics as they are now."""
        return view(*self.look())

    def look(self) -> tuple[list[Token], list[Any]]:
        """Return the parts of a view of the graph: every token, and each process's answer to `graph`.

        Tokens of other clients come in the answers of the run's processes: clients have no link to each other.
        """
        tokens, answers = {str(token): token for token in self.tokens()}, self.ask("graph")
        for text in {text for answer in answers for text in answer.get("elsewhere", ())} - tokens.keys():
            token = Token.parse(text)
            if token.session != self._zid:
                tokens[text] = token
        return list(tokens.values()), answers

    def type(self, name: str, type_hash: str | None = None) -> ForeignType:
        """Return a message type that the run uses, which reads and writes messages; a hash says which of several.

        Raises:
            NoSuchTarget: no topic of the run has this type.
            MalformedMessage: the description that is offered is not the one its hash stands for.
        """
        from busflow.interfaces.encoding.foreign import (
            ForeignType,  # a client that reads no message does not pay for the codec
        )

        key = name, type_hash
        if key not in self._types:
            which = {} if type_hash is None else {"hash": type_hash}
            for answer in self.ask("types", names=[name], **which):
                for offered in answer.values():
                    if type_hash in (None, offered["hash"]):
                        self._types[key] = ForeignType(name, offered["hash"], offered["description"])
        if key not in self._types and (foreign := self._type_of_ros2(name, type_hash)) is not None:
            self._types[key] = foreign
        if key not in self._types:
            raise NoSuchTarget(f"the run does not say what {name} is")
        return self._types[key]

    def _type_of_ros2(self, name: str, type_hash: str | None) -> ForeignType | None:
        """Ask the nodes of ROS 2 that use a type to describe it; return None if none does.

        A type of a user's own is known to no other node.
        """
        from busflow.interfaces.encoding.foreign import ForeignType

        tokens = self.tokens()
        servers = {each.topic for each in tokens if each.type == _DESCRIPTIONS and each.kind is TokenKind.SERVICE}
        for user in (each for each in tokens if each.type == name and type_hash in (None, each.hash)):
            service = f"{user.node_name.rstrip('/')}/get_type_description"
            if service in servers:
                with suppress(BusflowError, LookupError, TypeError):  # of several users one may answer
                    wanted = {"type_name": user.type, "type_hash": user.hash, "include_type_sources": False}
                    answer = self.call(_description_service(service), wanted, timeout_s=self._patience_s)
                    plain = json.loads(json.dumps(answer["type_description"]))  # it has tuples in place of lists
                    return ForeignType(user.type, user.hash, plain)
        return None

    # Listening and publishing.

    @contextmanager
    def listen(
        self,
        topic: TopicView,
        type_: ForeignType | None = None,
        *,
        depth: int = 1000,
        most_bytes: int = MOST_BYTES,
        on_arrival: Callable[[], None] | None = None,
        listener: Listener | None = None,
    ) -> Generator[Listener]:
        """Receive a topic while the block lasts; of more than `depth` that wait, the oldest are lost.

        What transient_local publishers keep for late joiners comes first. The other arguments are those of the
        `Listener` that is made where none is given.
        """
        type_ = type_ or self.type(topic.types[0])
        latched = any(end.qos.latched for end in topic.publishers)
        with self._present(TokenKind.SUBSCRIPTION, topic.name, type_, _LEAST_QOS):
            listener = listener or Listener(depth, most_bytes=most_bytes, on_arrival=on_arrival)
            callback: Any = zenoh.handlers.Callback(listener.put, indirect=False)
            history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=depth)
            subscribers: list[Any] = [
                zenoh.ext.declare_advanced_subscriber(self.session, key, callback, history=history)
                if latched
                else self.session.declare_subscriber(key, callback)
                for key in self.keys(topic.name, type_)
            ]
            try:
                yield listener
            finally:
                for subscriber in subscribers:
                    subscriber.undeclare()

    @contextmanager
    def advertise(
        self, topic: str, type_: ForeignType, *, qos: str = _DEFAULT_QOS, settle: bool = True
    ) -> Generator[Speaker]:
        """Publish a topic while the block lasts, which begins when every process that receives it is ready.

        It ends when all that was published has arrived.

        Args:
            topic: its full name.
            type_: that of its messages.
            qos: what is offered, in the form of `qos_text.to_text`.
            settle: whether to wait for both; a caller that advertises several topics calls `settle` once instead.

        Raises:
            NotAllowed: this client may only look.
        """
        self.require(f"publish {topic}")
        with (
            self._present(TokenKind.PUBLISHER, topic, type_, qos) as token,
            speaking(self.session, token, type_, qos, keys=self.keys(topic, type_)) as speaker,
            ExitStack() as ends,
        ):
            if settle:
                self.settle()
                ends.callback(self.settle)
            yield speaker

    def settle(self) -> None:
        """Wait until all processes of the run have handled this client's tokens; 2 s at most, where one is blocked.

        Zenoh delivers a query after the tokens that were declared before it, and an answer after the subscribers that
        were. A process handles tokens and queries on its loop, in their order: once it has answered, it has admitted
        this client's publishers, and receives what they publish.

        A query does not overtake messages either: once it is answered, all that was published before has arrived. The
        end of a token or of a session does overtake them, and large ones would be lost.
        """
        for _ in self._replies("run", {}, timeouts.current.settled):
            pass

    def service(self, name: str, *, events: bool = False) -> ServiceKind:
        """Return the types of a service; with `events` also that of its published calls.

        Raises:
            NoSuchTarget: no process of the run says what it is.
        """
        found = self.services([name], events=events)
        if name not in found:
            raise NoSuchTarget(f"the run does not say what the service {name} takes")
        return found[name]

    def services(self, names: Sequence[str], *, events: bool = False) -> dict[str, ServiceKind]:
        """Return the types of those services that a process of the run knows, as `service` does."""
        from busflow.interfaces.encoding.foreign import ForeignType

        found: dict[str, ServiceKind] = {}
        for answer in self.ask("services", names=list(names), events=events):
            for name, kind in answer.items():
                request, response = (
                    ForeignType(f"{kind['type']}_{part}", kind[part.lower()]["hash"], kind[part.lower()]["description"])
                    for part in ("Request", "Response")
                )
                event = kind.get("event")
                published = event and ForeignType(f"{kind['type']}_Event", event["hash"], event["description"])
                found[name] = ServiceKind(name, kind["type"], kind["hash"], request, response, published)
        return found

    def call(self, service: ServiceKind, values: Mapping[str, Any], *, timeout_s: float) -> Any:
        """Call a service, and return the answer as plain values.

        Raises:
            MalformedMessage: a value of the request does not fit, or the answer is none.
            ServiceError: there is no answer, for one of its reasons.
        """
        return service.response.decode(self.call_bytes(service, service.request.encode(values), timeout_s=timeout_s))

    def call_bytes(self, service: ServiceKind, payload: bytes, *, timeout_s: float) -> bytes:
        """Call a service with an encoded request, and return the encoded answer.

        Raises:
            ServiceError: there is no answer, for one of its reasons.
        """
        return self.call_with_remark(service, payload, timeout_s=timeout_s)[0]

    def call_with_remark(
        self, service: ServiceKind, payload: bytes, *, timeout_s: float, gid: bytes = bytes(16)
    ) -> tuple[bytes, str]:
        """Call a service as `call_bytes` does, as the client of this gid; return the server's remark too."""
        self.require(f"call {service.name}")
        replies = self.session.get(
            f"{self.key(service)}?{PATIENCE}={timeout_s};{REMARKS}=1",
            payload=payload,
            attachment=Attachment(1, 0, gid).encode(),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout_s,
        )
        refused = None
        for reply in replies:
            if reply.ok is not None:
                beside = b"" if reply.ok.attachment is None else reply.ok.attachment.to_bytes()[ATTACHMENT_BYTES:]
                return reply.ok.payload.to_bytes(), printable(beside.decode(errors="replace"), limit=400)
            if reply.err is not None:
                refused = refused or reply.err.payload.to_bytes()
        if refused == _TIMED_OUT:
            raise ServiceTimeout(f"{service.name} did not answer within {timeout_s:g} s")
        raise service_refusal(service.name, "its server", refused or b"")

    def present_client(self, service: ServiceKind) -> AbstractContextManager[Token]:
        """Show a client of a service to the other processes while the block lasts."""
        return self._present(TokenKind.CLIENT, service.name, service, _DEFAULT_QOS)

    def _replies(self, question: str, arguments: Mapping[str, Any], timeout_s: float) -> Any:
        return self.session.get(
            f"{QUERY_PREFIX}/*/{question}",
            payload=json.dumps(arguments),
            congestion_control=zenoh.CongestionControl.DROP,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout_s,
        )

    @contextmanager
    def _present(self, kind: TokenKind, topic: str, type_: ForeignType | ServiceKind, qos: str) -> Generator[Token]:
        """Show a node with one endpoint to the other processes."""
        node = Token(self._zid, 0, 0, TokenKind.NODE, "/", self._name, domain=self.domain)
        name, type_hash = (type_.type, type_.hash) if isinstance(type_, ServiceKind) else (type_.name, type_.type_hash)
        end = replace(node, entity_id=next(self._ids), kind=kind, topic=topic, type=name, hash=type_hash, qos=qos)
        liveliness = self.session.liveliness()
        with liveliness.declare_token(str(node)), liveliness.declare_token(str(end)):
            yield end


def run_called(name: str | None) -> FoundRun | RemoteRun:
    """Return the run of a name on this machine; or, for `viewer@robot.yaml`, that of a launch file on other machines.

    Raises:
        NoSuchRun: there is none, or it has to be said which.
        LaunchError: the launch file, or what it lets in by, will not do.
    """
    if name is None or AT not in name:
        return find_run(name)
    from busflow.wire.machines.remote import remote_run  # a client on this machine does not pay for launch files

    return remote_run(name)


@contextmanager
def join(name: str | None = None, *, patience_s: float | None = None) -> Generator[Peer]:
    """Join a run while the block lasts; without a name, the only one there is.

    It waits for `patience_s` at most for each answer.

    Raises:
        NoSuchRun: there is none, or it has to be said which.
        InspectionUnavailable: it does not answer.
    """
    peer = Peer(run_called(name), patience_s=patience_s)
    try:
        if not peer.run.card.pid:  # a run on other machines says what it is only when it is asked
            peer.run = peer.run.answered(peer.ask("run"))
        yield peer
    finally:
        peer.close()


def _description_service(name: str) -> ServiceKind:
    """Return the service of this name by which a node describes its types."""
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.interfaces.encoding.typesupport import TypeSupport
    from busflow.msgs.type_description_interfaces import GetTypeDescription

    whole, *halves = map(TypeSupport, (GetTypeDescription, GetTypeDescription.Request, GetTypeDescription.Response))
    request, response = (ForeignType(each.name, each.type_hash, each.description) for each in halves)
    return ServiceKind(name, whole.name, whole.type_hash, request, response)


def _parsed(payload: bytes) -> dict[str, Any]:
    """Parse a process's answer; an invalid one becomes a refusal."""
    try:
        found = json.loads(payload)
    except (ValueError, RecursionError):
        found = None
    return found if isinstance(found, dict) else {"kind": "", "error": "a process of the run gave an invalid answer"}
