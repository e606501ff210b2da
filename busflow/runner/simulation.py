"""Following: the time of a run moves after a simulator's `/clock`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from busflow.bus.bus import BusObserver
from busflow.bus.endpoint import Endpoint
from busflow.bus.qos import QoS, Reliability
from busflow.bus.subscription import Subscription
from busflow.clock import SimClock, Time
from busflow.errors import IncompatibleType
from busflow.interfaces.message import type_name
from busflow.msgs.rosgraph_msgs import Clock
from busflow.runner.extension import Extension
from busflow.runner.graph import Graph
from busflow.runner.loops.virtual import VirtualLoop

if TYPE_CHECKING:
    from busflow.bus.topic import Topic
    from busflow.runner.assembly import Run


TOPIC = "/clock"
_NODE = "/_clock"
_QOS = QoS(depth=1, reliability=Reliability.BEST_EFFORT)
"""QoS of the subscription: every simulator's publisher satisfies it."""


def follow(run: Run) -> None:
    """Let the time of a run follow `/clock`, which another process may publish if other terminals can find the run."""
    clock = run.graph.clock
    if isinstance(clock, SimClock):
        following = Following(run.graph, clock, run.virtual_loop)
        if run.is_shown:
            run.graph.attach(following)


class Following(Extension, BusObserver):
    """Moves a loop's time to the stamps that a simulator publishes on `/clock`.

    The clock shows 0 before the first message, as in ROS 2. That message sets the clock to the simulator's time, and no
    virtual time passes. When a later stamp moves time forwards, everything that was due in between happens once, and
    timers count the ticks that they missed. When a stamp sets the clock back, a timer starts again if its last tick is
    now in the future, and otherwise waits for the stamp of its next tick; a sleep lasts as long as it was to last.
    """

    def __init__(self, graph: Graph, clock: SimClock, loop: VirtualLoop) -> None:
        """Set the clock to 0, and follow the topic from its first endpoint on; the graph has not started."""
        self._clock, self._loop, self._bus = clock, loop, graph.bus
        self._began = False
        clock.start_at(Time(0))
        graph.bus.observe(self)

    def begin(self) -> None:
        """Subscribe to the topic, so that a simulator in another process finds it if this run is inspectable."""
        endpoint = Endpoint(_NODE, TOPIC, Clock, _QOS, "the run's clock", TOPIC)
        subscription = Subscription(Clock, endpoint, _ignore)
        self._bus.attach_subscription(subscription, lambda _error, _message: None)
        subscription.open()

    def topic_added(self, topic: Topic[Any]) -> None:
        """Follow the topic `/clock`; its type must be rosgraph_msgs/msg/Clock."""
        if topic.name == TOPIC:
            if topic.type is not Clock:
                actual, wanted = type_name(topic.type), type_name(Clock)
                raise IncompatibleType(f"{TOPIC} carries {actual}; a run whose time follows it needs {wanted}")
            self._bus.tap(topic, self._follow)

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


def _ignore(_message: Clock) -> None:
    """Ignore the message: the tap has handled it before it entered a queue."""
