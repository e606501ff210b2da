"""Actions of a run as a client of it sees them, and a goal that it sends."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import zenoh

from busflow import timeouts
from busflow.actions.names import CANCEL_GOAL, FEEDBACK, GET_RESULT, SEND_GOAL, STATUS, action_of, action_type_of
from busflow.bus.names import absolute_name, is_hidden
from busflow.clock import NS_PER_S
from busflow.errors import ActionGone, ActionUnavailable, GoalCanceled, GoalRejected, NoSuchTarget
from busflow.interfaces.encoding.description import assemble, rihs01, types_in
from busflow.text import did_you_mean, printable
from busflow.wire.client.graph_view import TopicView
from busflow.wire.client.known_type import known_service, known_type
from busflow.wire.zenoh.keys import ATTACHMENT_BYTES, REMARKS, Attachment

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.wire.client.client import Peer, ServiceKind
    from busflow.wire.client.graph_view import GraphView

_FOREVER_S = 10 * 365 * 86_400
_REFUSALS = {1: "no goal can be canceled", 2: "no goal has this identifier", 3: "the goal has ended already"}
"""Why a cancel was refused, by ROS 2's code."""


@dataclass(frozen=True, slots=True)
class ActionView:
    """An action, with the nodes of its servers and clients."""

    name: str
    types: tuple[str, ...]
    servers: tuple[str, ...]
    clients: tuple[str, ...]

    @property
    def type(self) -> str:
        """Its type, or those that are in conflict."""
        return ", ".join(self.types)

    @property
    def topics(self) -> tuple[str, str]:
        """The names of the topics of its feedback and of its goals' states, which are hidden."""
        return self.name + FEEDBACK, self.name + STATUS


def actions_of(graph: GraphView) -> dict[str, ActionView]:
    """Return the actions of a graph by name: those with an endpoint of `send_goal`."""
    found: dict[str, ActionView] = {}
    for service in graph.services.values():
        name = action_of(service.name)
        if name is not None and service.name == name + SEND_GOAL:
            types = tuple(action_type_of(each) or each for each in service.types)
            servers, clients = ([end.node for end in ends] for ends in (service.publishers, service.subscriptions))
            found[name] = ActionView(name, types, tuple(servers), tuple(clients))
    return found


def action_named(graph: GraphView, name: str) -> ActionView:
    """Return the action of a name, whose leading slash may be left out.

    Raises:
        NoSuchTarget: there is none; the message names the nearest.
    """
    known, full = actions_of(graph), absolute_name(name)
    if full not in known:
        near = did_you_mean(full, [each for each in known if not is_hidden(each)], none="no node has one")
        raise NoSuchTarget(f"there is no action {printable(full)}; {near}")
    return known[full]


class ActionPeer:
    """A client of one action of a run."""

    def __init__(self, peer: Peer, action: ActionView) -> None:
        """Learn the action's types.

        Raises:
            NoSuchTarget: it lacks one of its services.
            UnknownType: neither the run nor a definition file says what they are.
        """
        self._peer = peer
        self.action: ActionView = action
        graph = peer.graph()
        self._send, self._cancel, self._result = (
            known_service(peer, graph.service(action.name + suffix)) for suffix in (SEND_GOAL, CANCEL_GOAL, GET_RESULT)
        )
        self.goal_type: ForeignType = _part(self._send.request, f"{action.types[0]}_Goal")
        self.result_type: ForeignType = _part(self._result.response, f"{action.types[0]}_Result")

    @property
    def feedback_topic(self) -> TopicView:
        """The topic of the feedback."""
        return self._topic(FEEDBACK, f"{self.action.types[0]}_FeedbackMessage")

    def _topic(self, suffix: str, type_name: str) -> TopicView:
        name = self.action.name + suffix
        return self._peer.graph().topics.get(name) or TopicView(name, (type_name,), (), ())

    @contextmanager
    def sent(
        self, goal: Mapping[str, Any], *, timeout_s: float, on_feedback: Callable[[Any], None] | None = None
    ) -> Generator[PeerGoal]:
        """Send a goal that lasts as long as the block; the run cancels it when this process has ended.

        Raises:
            ActionUnavailable: the action has no server.
            GoalRejected: the server does not take the goal.
            ServiceError: there is no answer.
        """
        if not self.action.servers:
            raise ActionUnavailable(f"{self.action.name} has clients only, no server")
        arrived = threading.Event()
        goal_id = uuid.uuid4()
        with self._peer.present_client(self._send) as token:
            topic = self.feedback_topic
            if on_feedback is None:
                self._peer.settle()  # the server's process knows this client before its goal
                yield self._begin(goal_id, goal, token.gid, arrived, timeout_s)
                return
            feedback = known_type(self._peer, topic.types[0])
            with self._peer.listen(topic, feedback, on_arrival=arrived.set) as listener:
                self._peer.settle()
                going = self._begin(goal_id, goal, token.gid, arrived, timeout_s)
                going.follow(listener, feedback, on_feedback)
                yield going

    def _begin(
        self, goal_id: uuid.UUID, goal: Mapping[str, Any], gid: bytes, arrived: threading.Event, timeout_s: float
    ) -> PeerGoal:
        request = self._send.request.encode({"goal_id": _uuid(goal_id), "goal": goal})
        payload, remark = self._peer.call_with_remark(self._send, request, timeout_s=timeout_s, gid=gid)
        if not self._send.response.decode(payload)["accepted"]:
            raise GoalRejected(f"the goal was rejected: {remark or 'the server gives no reason'}")
        return PeerGoal(self._peer, self, self._result, goal_id, gid, arrived)

    def cancel(self, goal_id: uuid.UUID | None, *, timeout_s: float) -> list[str]:
        """Cancel one goal, or all; return the identifiers of those that end now.

        Raises:
            NoSuchTarget: the server refuses, for one of ROS 2's reasons; of all goals there may be none.
            ServiceError: there is no answer.
        """
        info = {"goal_id": _uuid(goal_id or uuid.UUID(int=0))}
        answer = self._peer.call(self._cancel, {"goal_info": info}, timeout_s=timeout_s)
        code, canceled = answer["return_code"], [_text(each["goal_id"]) for each in answer["goals_canceling"]]
        if code and (goal_id is not None or canceled):
            raise NoSuchTarget(f"{self.action.name}: {_REFUSALS.get(code, f'it is refused with code {code}')}")
        return canceled

    def goals(self) -> list[dict[str, Any]]:
        """Return the goals whose states the servers keep: `{id, state, accepted_ns}`, in their order."""
        topic = self._topic(STATUS, "action_msgs/msg/GoalStatusArray")
        type_, found = known_type(self._peer, "action_msgs/msg/GoalStatusArray"), dict[str, dict[str, Any]]()
        with self._peer.listen(topic, type_) as listener:
            for _ in topic.publishers:
                received = listener.get(timeouts.current.latched)
                for each in () if received is None else type_.decode(received.payload)["status_list"]:
                    stamp = each["goal_info"]["stamp"]
                    accepted_ns = stamp["sec"] * NS_PER_S + stamp["nanosec"]
                    goal_id = _text(each["goal_info"]["goal_id"])
                    found[goal_id] = {"id": goal_id, "state": each["status"], "accepted_ns": accepted_ns}
        return list(found.values())


class PeerGoal:
    """A goal that a client of a run has sent."""

    def __init__(
        self,
        peer: Peer,
        action: ActionPeer,
        results: ServiceKind,
        goal_id: uuid.UUID,
        gid: bytes,
        arrived: threading.Event,
    ) -> None:
        """Ask for the result of a goal that was accepted."""
        self.id: uuid.UUID = goal_id
        self.remark: str = ""
        """Why it did not succeed, if the server says so."""
        self._peer, self._action, self._arrived = peer, action, arrived
        self._is_given_up = False
        self._results, self._answer = results, list[zenoh.Sample | None]()
        self._drain: Callable[[], None] = lambda: None

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._answer.append(reply.ok)
                arrived.set()

        def end() -> None:
            self._answer.append(None)
            arrived.set()

        peer.session.get(
            f"{peer.key(results)}?{REMARKS}=1",
            zenoh.handlers.Callback(on_reply, drop=end, indirect=False),
            payload=results.request.encode({"goal_id": _uuid(goal_id)}),
            attachment=Attachment(1, 0, gid).encode(),
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=_FOREVER_S,
        )

    def follow(self, listener: Any, type_: ForeignType, on_feedback: Callable[[Any], None]) -> None:
        """Call a function with each feedback on this goal, while `result` waits."""

        def drain() -> None:
            while (received := listener.get(0)) is not None:
                message: Any = type_.decode(received.payload)
                if _text(message["goal_id"]) == str(self.id):
                    on_feedback(message["feedback"])

        self._drain = drain

    def result(self) -> tuple[int, Any]:
        """Wait until the goal has ended; return its state and its result.

        Raises:
            ActionGone: the server has ended.
            GoalCanceled: `give_up` was called.
            RunEnded: the run has ended.
        """
        while not self._answer:
            if self._is_given_up:
                raise GoalCanceled(f"{self._action.action.name}: the goal {self.id} is waited for no longer")
            if not self._arrived.wait(1.0):
                self._peer.require_run()
            self._arrived.clear()
            self._drain()
        self._drain()
        sample = self._answer[0]
        if sample is None:
            raise ActionGone(f"{self._action.action.name}: its server ended before the goal {self.id} had")
        attachment = b"" if sample.attachment is None else sample.attachment.to_bytes()
        self.remark = printable(attachment[ATTACHMENT_BYTES:].decode(errors="replace"), limit=400)
        answer: Any = self._results.response.decode(sample.payload.to_bytes())
        return answer["status"], answer["result"]

    def give_up(self) -> None:
        """Let `result` raise instead of wait; from any thread."""
        self._is_given_up = True
        self._arrived.set()

    def cancel(self, *, timeout_s: float) -> None:
        """Ask the server to cancel the goal, if it has not ended."""
        with suppress(NoSuchTarget):
            self._action.cancel(self.id, timeout_s=timeout_s)


def _part(whole: ForeignType, name: str) -> ForeignType:
    """Return one of the types within another."""
    from busflow.interfaces.encoding.foreign import ForeignType

    description: Any = assemble(name, types_in(whole.description))  # type: ignore[arg-type]  # of ROS 2's form
    return ForeignType(name, rihs01(description), description)


def _uuid(goal_id: uuid.UUID) -> dict[str, list[int]]:
    return {"uuid": list(goal_id.bytes)}


def _text(goal_id: Mapping[str, Any]) -> str:
    return str(uuid.UUID(bytes=bytes(goal_id["uuid"])))
