"""Simulation: a graph that has virtual time to itself, to be run as fast as it goes or at a rate."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import closing, contextmanager
from typing import Any, cast

from busflow.bus.endpoint import Endpoint
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS, Reliability
from busflow.bus.subscription import Subscription
from busflow.clock import SimClock, Time
from busflow.errors import IncompatibleType
from busflow.interfaces.message import type_name
from busflow.launchfile.model.description import ClockMode, LaunchDescription
from busflow.msgs.rosgraph_msgs import Clock
from busflow.runner.extension import Extension
from busflow.runner.graph import Graph
from busflow.runner.loops.virtual import RUN_THREAD_S, VirtualLoop
from busflow.runner.sources import What


@contextmanager
def simulated_graph(
    what: Sequence[What], *, show: Callable[[Graph], object] | None = None, **options: Any
) -> Generator[tuple[Graph, Callable[[], VirtualLoop]]]:
    """Build a graph on simulated time, and the factory of the loop that `run_graph` runs it on.

    Args:
        what: As `Graph` takes it; a launch file's `clock` says how fast time goes.
        show: Lets the graph be looked into, where its time follows a simulator: that may be in another process.
        options: As `Graph` takes them.
    """
    clocks = [each.clock for each in what if isinstance(each, LaunchDescription)]
    rate = next((clock.rate for clock in clocks if clock.rate is not None), None)
    follows = any(clock.mode is ClockMode.FOLLOW for clock in clocks)
    with closing(VirtualLoop(rate=rate, follows=follows, thread_s=RUN_THREAD_S, ends_handlers=False)) as loop:
        clock = SimClock(loop=loop)
        graph = Graph(what, clock=clock, **options)
        if follows:
            following = Following(graph, clock, loop)
            if show is not None:
                show(graph)  # before there is anything to be seen
                graph.attach(following)
        yield graph, lambda: loop


TOPIC = "/clock"
_NODE = "/_clock"
_QOS = QoS(depth=1, reliability=Reliability.BEST_EFFORT)
"""QoS that every simulator offers."""


class Following(Extension):
    """Moves a loop's time as a graph's simulator says.

    Before the first message it is 0, as in ROS 2; then the stamps begin where the simulator does, and no time has
    passed. Forwards, what was due meanwhile comes once, and timers count the ticks that they missed. Backwards, a timer
    starts anew if its last tick is in the future now, and otherwise waits for the stamp of its next tick. A sleep lasts
    as long as it was to.
    """

    def __init__(self, graph: Graph, clock: SimClock, loop: VirtualLoop) -> None:
        """Listen from the first publisher of the topic on; the graph has yet to be started."""
        self._clock, self._loop, self._bus = clock, loop, graph.bus
        self._tapped = self._began = False
        clock.start_at(Time(0))
        graph.bus.on_attach.append(self._on_attach)

    def begin(self) -> None:
        """Receive the topic, so that a simulator in another process finds it once this run can be looked into."""
        endpoint = Endpoint(_NODE, TOPIC, Clock, _QOS, "the run's clock", TOPIC)
        subscription = Subscription(Clock, endpoint, _pass_over)
        self._bus.attach_subscription(subscription, lambda _error, _message: None)
        subscription.open()

    def _on_attach(self, attached: object) -> None:
        if not isinstance(attached, Publisher) or self._tapped:
            return
        publisher = cast("Publisher[Any]", attached)
        if publisher.topic == TOPIC:
            if publisher.type is not Clock:
                actual, wanted = type_name(publisher.type), type_name(Clock)
                raise IncompatibleType(f"{TOPIC} carries {actual}; a run whose time follows it needs {wanted}")
            self._tapped = True
            self._bus.tap(self._bus.topics[TOPIC], self._follow)

    def _follow(self, message: Clock) -> None:
        stamp = Time.from_msg(message.clock)
        by = stamp - self._clock.now()
        if not self._began:
            self._began = True
            self._clock.start_at(stamp)
        elif by.nanoseconds >= 0:
            self._loop.move_to(self._loop.time_ns() + by.nanoseconds)
        else:
            self._clock.jump(by)
            for listener in tuple(self._clock.on_jump):
                listener(by)


def _pass_over(_message: Clock) -> None:
    """Ignore the message: the tap has handled it before any queue had it."""
