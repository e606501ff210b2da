"""Both ends of the action `Fibonacci` on a raw Zenoh session, byte by byte as `rcl_action` and `rmw_zenoh` have them.

Names, QoS and CDR are written out; nothing of busflow's actions is used but the hashes of the types.
"""

import struct
import threading
from collections.abc import Callable, Sequence
from typing import Any

from busflow.interfaces.action import derived_types
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.action_msgs import CancelGoal, GoalStatusArray
from busflow.msgs.example_interfaces import Fibonacci
from tests.ros2.rmw_node import RELIABLE, STATUS, RmwNode

SEND_GOAL, GET_RESULT, FEEDBACK = map(TypeSupport, derived_types(Fibonacci))
CANCEL_GOAL, STATUSES = TypeSupport(CancelGoal), TypeSupport(GoalStatusArray)
HEAD = b"\0\1\0\0"
ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = range(1, 7)


def numbers(sequence: Sequence[int]) -> bytes:
    """`int32[]` as CDR."""
    return struct.pack(f"<I{len(sequence)}i", len(sequence), *sequence)


def read_numbers(payload: bytes, at: int) -> list[int]:
    (length,) = struct.unpack_from("<I", payload, at)
    assert len(payload) == at + 4 + 4 * length
    return list(struct.unpack_from(f"<{length}i", payload, at + 4))


def read_statuses(payload: bytes) -> dict[bytes, int]:
    """The states in a `GoalStatusArray`, by goal."""
    (length,) = struct.unpack_from("<I", payload, 4)
    found, at = {}, 8
    for _ in range(length):
        stamp = (at + 16 + 3) // 4 * 4
        found[payload[at : at + 16]] = payload[stamp + 8]
        at = stamp + 9
    assert at == len(payload)
    return found


class FibonacciClient:
    """An action client of a node of ROS 2."""

    def __init__(self, node: RmwNode, action: str, on_event: Callable[[tuple[Any, ...]], None]) -> None:
        """`on_event` gets `("feedback", goal, sequence)` and `("status", states by goal)`, in a thread of Zenoh."""
        self.node = node
        part = f"{action}/_action/"
        self._send = node.client(f"{part}send_goal", SEND_GOAL)
        self._result = node.client(f"{part}get_result", GET_RESULT)
        self._cancel = node.client(f"{part}cancel_goal", CANCEL_GOAL)

        def on_feedback(sample: Any) -> None:
            payload = sample.payload.to_bytes()
            on_event(("feedback", payload[4:20], read_numbers(payload, 20)))

        def on_status(sample: Any) -> None:
            on_event(("status", read_statuses(sample.payload.to_bytes())))

        node.subscription(f"{part}feedback", FEEDBACK, on_feedback)
        node.subscription(f"{part}status", STATUSES, on_status, STATUS)

    def send(self, goal: bytes, order: int) -> bool:
        """Send a goal; return whether it is accepted."""
        answer, *_ = self._send(HEAD + goal + struct.pack("<i", order))
        accepted, _, nanoseconds = struct.unpack_from("<B3xiI", answer, 4)
        assert (len(answer), nanoseconds < 1_000_000_000) == (16, True)
        return bool(accepted)

    def result(self, goal: bytes) -> tuple[int, list[int]]:
        """Wait for a goal's result; return its state and sequence."""
        answer, *_ = self._result(HEAD + goal)
        return answer[4], read_numbers(answer, 8)

    def cancel(self, goal: bytes = bytes(16), stamp: tuple[int, int] = (0, 0)) -> tuple[int, list[bytes]]:
        """Ask to cancel a goal; return the code, and the goals that are canceled."""
        answer, *_ = self._cancel(HEAD + goal + struct.pack("<iI", *stamp))
        (length,) = struct.unpack_from("<I", answer, 8)
        return answer[4], [answer[12 + 24 * each : 28 + 24 * each] for each in range(length)]


class FibonacciServer:
    """An action server of a node of ROS 2, whose goals do what the test says."""

    def __init__(self, node: RmwNode, action: str, on_goal: Callable[[bytes, int], None]) -> None:
        """`on_goal` gets each goal that is accepted, in a thread of Zenoh; negative orders are not."""
        self.states: dict[bytes, int] = {}
        self._results: dict[bytes, bytes] = {}
        self._asked: dict[bytes, list[Callable[[bytes], None]]] = {}
        self._on_goal, self._lock = on_goal, threading.Lock()
        part = f"{action}/_action/"
        node.server(f"{part}send_goal", SEND_GOAL, self._answer_goal)
        node.late_server(f"{part}get_result", GET_RESULT, self._answer_result)
        node.server(f"{part}cancel_goal", CANCEL_GOAL, self._answer_cancel)
        self._feedback = node.publisher(f"{part}feedback", FEEDBACK, RELIABLE)
        self._status = node.publisher(f"{part}status", STATUSES, STATUS)

    def is_asked_for(self, goal: bytes) -> bool:
        """Whether a client waits for a goal's result."""
        return goal in self._asked

    def feedback(self, goal: bytes, sequence: Sequence[int]) -> None:
        """Publish feedback on a goal."""
        self._feedback(HEAD + goal + numbers(sequence))

    def finish(self, goal: bytes, state: int, sequence: Sequence[int] = ()) -> None:
        """End a goal."""
        with self._lock:
            self.states[goal] = state
            self._results[goal] = HEAD + bytes((state, 0, 0, 0)) + numbers(sequence)
            asked = self._asked.pop(goal, [])
        self._publish_states()
        for reply in asked:
            reply(self._results[goal])

    def _publish_states(self) -> None:
        body = b""
        for goal, state in self.states.items():
            body += goal
            body += bytes(-len(body) % 4) + struct.pack("<iIB", 1, 2, state)
        self._status(HEAD + struct.pack("<I", len(self.states)) + body)

    def _answer_goal(self, request: bytes) -> bytes:
        goal, (order,) = request[4:20], struct.unpack_from("<i", request, 20)
        assert len(request) == 24
        if order >= 0:
            self.states[goal] = EXECUTING
            self._publish_states()
            self._on_goal(goal, order)
        return HEAD + struct.pack("<B3xiI", order >= 0, 1, 2)

    def _answer_result(self, request: bytes, reply: Callable[[bytes], None]) -> None:
        goal = request[4:20]
        with self._lock:
            if goal in self.states and goal not in self._results:
                self._asked.setdefault(goal, []).append(reply)
                return
        reply(self._results.get(goal, HEAD + bytes(4) + numbers(())))

    def _answer_cancel(self, request: bytes) -> bytes:
        goal = request[4:20]
        assert len(request) == 28
        chosen = [each for each, state in self.states.items() if state == EXECUTING and goal in (each, bytes(16))]
        code = 0 if chosen else 2 if goal not in self.states else 3
        for each in chosen:
            self.states[each] = CANCELING
        self._publish_states()
        infos = b"".join(each + struct.pack("<iI", 1, 2) for each in chosen)
        return HEAD + struct.pack("<b3xI", code, len(chosen)) + infos
