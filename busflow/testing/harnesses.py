"""Harness: a whole graph of unchanged nodes in one test, on virtual time.

It is `busflow.launch` with a simulated clock, and adds what a test needs: to let time pass, to see what was published,
and to inject faults.
"""

from __future__ import annotations

import asyncio
import os
from collections import defaultdict, deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Never, Self, TypeVar, cast, overload

from busflow.actions.client import ActionClient
from busflow.actions.goal import F, G, Parts, R
from busflow.bus.bus import Bus, BusObserver
from busflow.bus.names import absolute_name
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.bus.services.call import Pair, Req, Res
from busflow.bus.services.client import TIMEOUT_S
from busflow.bus.statistics import SubscriptionStatistics
from busflow.bus.subscription import Subscription
from busflow.bus.topic import Topic
from busflow.clock import Duration, SimClock
from busflow.errors import BusflowError, IncompatibleType, NodeFailed, NoSuchTarget, NotRunning, NotSeen
from busflow.interfaces.message import Message, type_name
from busflow.launchfile.model.description import ClockMode
from busflow.log import LogRecord
from busflow.node.declarations import checked_name
from busflow.node.node import Node, runtime_of
from busflow.runner.assembly import Given, Kind, Run
from busflow.runner.graph import Graph, Wanted, What
from busflow.runner.loops.stalls import waiting
from busflow.runner.loops.virtual import VirtualLoop
from busflow.runner.simulation import TOPIC as CLOCK
from busflow.runner.simulation import Following
from busflow.testing.link_faults import Faults
from busflow.text import did_you_mean


@dataclass(frozen=True, slots=True)
class Ledger:
    """Account of all subscriptions, past and present; in each line, published = delivered + dropped + queued."""

    lines: tuple[SubscriptionStatistics, ...]

    @property
    def published(self) -> int:
        """Number of published messages, counted once for each subscription."""
        return sum(line.published for line in self.lines)

    @property
    def delivered(self) -> int:
        """Number of messages that were handed over."""
        return sum(line.delivered for line in self.lines)

    @property
    def dropped(self) -> int:
        """Number of messages that were lost, for whatever reason."""
        return sum(line.dropped for line in self.lines)

    @property
    def queued(self) -> int:
        """Number of messages that are queued now."""
        return sum(line.queued for line in self.lines)

    def __iter__(self) -> Iterator[SubscriptionStatistics]:
        return iter(self.lines)

    def __str__(self) -> str:
        return "\n".join(map(_shown, self.lines))


def _shown(line: SubscriptionStatistics) -> str:
    reasons = ", ".join(f"{count} {reason}" for reason, count in sorted(line.drops.items()))
    return (
        f"{line.node} on {line.topic}: {line.published} published = {line.delivered} delivered + "
        f"{line.dropped} dropped{f' ({reasons})' if reasons else ''} + {line.queued} queued"
    )


N = TypeVar("N", bound=Node)
M = TypeVar("M", bound=Message)

KEPT = 10_000
"""Messages of each topic that a harness keeps where `keep` says nothing: 100 s at 100 Hz."""

_AS_WRITTEN = "write @virtual_time, below it async def test_…(), and in it async with harness(…) as lab:"


class _Traffic:
    """The messages that were published on one topic, and how many of them `wait_for` has not returned."""

    __slots__ = ("arrival", "kept", "published", "unseen")

    def __init__(self, keep: int) -> None:
        self.kept: deque[Message] = deque(maxlen=keep)
        self.published = 0
        self.unseen = 0
        self.arrival: asyncio.Event | None = None
        """Set by the next message, where a test waits for it."""

    def add(self, message: Message) -> None:
        """Keep one more message."""
        self.kept.append(message)
        self.published += 1
        self.unseen += 1
        if self.arrival is not None:
            self.arrival.set()
            self.arrival = None

    def next(self) -> Message:
        """Return the oldest message that was not returned yet and is kept."""
        first = max(0, len(self.kept) - self.unseen)
        self.unseen = len(self.kept) - first - 1
        return self.kept[first]


class _Listener(BusObserver):
    """Listener to every topic from the moment it exists."""

    def __init__(self, bus: Bus, traffic: Mapping[str, _Traffic]) -> None:
        self._bus, self._traffic = bus, traffic

    def topic_added(self, topic: Topic[Any]) -> None:
        self._bus.tap(topic, self._traffic[topic.name].add)


class Harness:
    """A graph under test: use it as `async with harness(...) as lab`, on a virtual loop."""

    def __init__(
        self,
        *what: What,
        args: Mapping[str, object] | None = None,
        seed: int | None = None,
        expect_failure: type[Node] | str | None = None,
        keep: int | None = None,
        log_level: str = "info",
        record: Wanted = False,
    ) -> None:
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            raise NotRunning(f"a harness needs an async test on virtual time: {_AS_WRITTEN}") from None
        if not isinstance(loop, VirtualLoop):
            raise NotRunning("a harness needs virtual time: put @virtual_time above the test")
        self.log: list[LogRecord] = []
        """Lines that the nodes have logged, the oldest first; of more than 10,000 the newest."""
        self.clock: SimClock = SimClock()
        given = Given(
            args=args,
            seed=given_seed() if seed is None and loop.schedule is None else seed,
            clock=self.clock,
            log_level=log_level,
            sinks=(self._keep_line,),
            explore=loop.schedule,
            record=record,
        )
        self.graph: Graph = Run(what, Kind.HARNESS, given).build()
        self._loop = loop
        self._traffic: dict[str, _Traffic] = defaultdict(lambda: _Traffic(KEPT if keep is None else keep))
        self._only_newest = keep is not None
        self._expected = expect_failure
        self._is_entered = False
        self._faults = Faults(self.graph.bus)
        self.graph.bus.observe(_Listener(self.graph.bus, self._traffic))
        if loop.follows:
            Following(self.graph, self.clock, loop)
        elif any(each.clock.mode is ClockMode.FOLLOW for each in self.graph.descriptions):
            raise NotRunning(f"the time of {self.graph.name} follows /clock: write @virtual_time(follows=True)")

    def _keep_line(self, line: LogRecord) -> None:
        self.log.append(line)
        del self.log[:-KEPT]

    if not TYPE_CHECKING:  # type checkers refuse it themselves

        def __enter__(self) -> Never:
            raise NotRunning(f"a harness starts and stops nodes, which takes an async with: {_AS_WRITTEN}")

        def __exit__(self, *_: object) -> None:
            """Never called: without this method Python would not call `__enter__` either."""

    async def __aenter__(self) -> Self:
        self._is_entered = True
        if self._expected is None:
            await self.graph.__aenter__()
        else:  # the failure is what the test is about: it must not end the test's own block
            with suppress(NodeFailed):
                await self.graph.start()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._expected is None:
            await self.graph.__aexit__(kind, error, trace)
            return
        await self.graph.stop()
        failures = self.graph.failures
        expected = runtime_of(self.node(self._expected)).full_name
        if error is None and [failure.node for failure in failures] != [expected]:
            others = "; ".join(f"{failure.node} {failure.summary}" for failure in failures) or "nothing failed"
            raise NotSeen(f"{expected} alone was expected to fail, but {others}")

    # Time.

    async def advance(self, seconds: float) -> None:
        """Let virtual time pass, including all that is due exactly at its end, and settle.

        Raises:
            NotRunning: The harness was never entered, so a test would show nothing.
        """
        if not 0 <= seconds < float("inf"):
            raise ValueError(f"time passes forwards, by a finite number of seconds, not {seconds!r}")
        if not self._is_entered:
            raise NotRunning(f"no node of this harness was started: {_AS_WRITTEN}")
        await self._loop.advance(seconds)

    async def settle(self) -> None:
        """Run everything that is due now; time does not move."""
        await self._loop.settle()

    # What happened.

    @overload
    def received(self, topic: str) -> list[Any]: ...
    @overload
    def received(self, topic: str, message_type: type[M]) -> list[M]: ...
    def received(self, topic: str, message_type: type[M] | None = None) -> list[M] | list[Any]:
        """Return the messages published on a topic so far, received by a node or not; with `keep`, the newest.

        Raises:
            NotSeen: There were more than 10,000, and `keep` does not say how many of them to keep.
        """
        name = self._known(topic, message_type)
        traffic = self._traffic[name]
        self._refuse_forgotten(traffic, name, traffic.published)
        return list(cast("deque[Any]", traffic.kept))

    @overload
    async def wait_for(self, topic: str, *, timeout: float = 10.0) -> Any: ...  # noqa: ASYNC109  # of virtual seconds
    @overload
    async def wait_for(self, topic: str, message_type: type[M], *, timeout: float = 10.0) -> M: ...  # noqa: ASYNC109  # as above
    async def wait_for(self, topic: str, message_type: type[M] | None = None, *, timeout: float = 10.0) -> Any:  # noqa: ASYNC109  # as above
        """Return the next message on a topic that no `wait_for` has returned yet; wait for it if need be.

        Args:
            topic: The topic's name.
            message_type: What it carries, for type checkers; checked.
            timeout: Virtual seconds.

        Raises:
            NotSeen: Nothing came in time; says who published what, and who waits for what. Or the next message is no
                longer kept.
        """
        name = self._known(topic, message_type)
        traffic = self._traffic[name]
        try:
            async with asyncio.timeout(timeout):
                while not traffic.unseen:
                    traffic.arrival = traffic.arrival or asyncio.Event()
                    await traffic.arrival.wait()
        except TimeoutError:
            raise NotSeen(self._why_nothing_came(name, timeout)) from None
        self._refuse_forgotten(traffic, name, traffic.unseen)
        return traffic.next()

    @property
    def ledger(self) -> Ledger:
        """Ledger of every subscription, as it stands now."""
        return Ledger(tuple(self.graph.bus.ledger()))

    @overload
    def node(self, which: type[N]) -> N: ...
    @overload
    def node(self, which: str) -> Node: ...
    def node(self, which: type[N] | str) -> N | Node:
        """Return the node of a class, or of a name."""
        return self.graph.node(cast("Any", which))

    # What the test does.

    def publish(self, topic: str, message: Message) -> None:
        """Publish a message from outside on a topic with a subscription; `advertise` a topic without one.

        Raises:
            NotSeen: No node has received the topic so far: a test would wait in vain for what comes of it.
        """
        if self.graph.supervisors:
            self._refuse_unheard(topic, message)
        self.graph.publish(topic, message)

    def set_parameters(
        self, which: type[Node] | str, changes: Mapping[str, object] | None = None, /, **values: object
    ) -> tuple[str, ...]:
        """Set parameters of a node: `lab.set_parameters(SensorPublisher, rate_hz=20)`, or a mapping with dotted names.

        Returns the names of those that changed; the change has happened by then.

        Raises:
            InvalidParameter: With every reason why none was set.
        """
        return self.graph.set_parameters(which, changes, **values)

    def advertise(self, message_type: type[M], topic: str, *, qos: QoS | None = None) -> Publisher[M]:
        """Create a publisher of the test's own."""
        return self.graph.advertise(message_type, topic, qos=qos)

    def subscribe(self, message_type: type[M], topic: str, *, qos: QoS | None = None) -> Subscription[M]:
        """Create a subscription of the test's own, to pull from.

        Raises:
            NotSeen: The topic is unknown, and its name like that of another.
        """
        try:
            return self.graph.subscribe(message_type, topic, qos=qos)
        except NoSuchTarget as error:
            raise NotSeen(str(error)) from None

    async def call(
        self,
        service_type: type[Pair[Req, Res]],
        service: str,
        request: Req | None = None,
        *,
        timeout: float | None = TIMEOUT_S,  # noqa: ASYNC109  # of virtual seconds
    ) -> Res:
        """Call a service from outside; the timeout is in virtual seconds.

        Raises:
            ServiceError: There is no answer, as `Client.call` says.
        """
        return await self.graph.call(service_type, service, request, timeout=timeout)

    async def run_action(
        self,
        action_type: type[Parts[G, R, F]],
        action: str,
        goal: G,
        *,
        timeout: float | None = None,  # noqa: ASYNC109  # of virtual seconds
        on_feedback: Callable[[F], object] | None = None,
    ) -> R:
        """Send a goal from outside, and return its result; the timeout is in virtual seconds.

        Raises:
            ActionError: The goal did not succeed, as `ActionClient.run` says.
        """
        return await self.action_client(action_type, action).run(goal, timeout=timeout, on_feedback=on_feedback)

    def action_client(self, action_type: type[Parts[G, R, F]], action: str) -> ActionClient[Parts[G, R, F]]:
        """Return a client of an action of the test's own, to follow and cancel its goals."""
        return self.graph.outside().action_client(action_type, action)

    # Faults that the test injects.

    def fail(self, which: type[Node] | str, error: BaseException) -> None:
        """Make a node fail now, as if its own code had raised; `harness(expect_failure=…)` makes the test expect it."""
        runtime_of(self.node(cast("Any", which))).life.fail("Harness.fail", error)

    def delay(self, topic: str, seconds: float) -> None:
        """Delay messages that are published on a topic from now on, in order; meanwhile they count as queued."""
        self._faults.delay(self._known(topic), seconds)

    def drop(self, topic: str, *, every: int = 1) -> None:
        """Drop every n-th message of a topic from now on; the reason of these drops is `injected`."""
        self._faults.drop(self._known(topic), every)

    def heal(self, topic: str) -> None:
        """End the effect of `delay` and `drop` on a topic."""
        self._faults.heal(self._known(topic))

    def jump(self, seconds: float) -> None:
        """Set the clock of the stamps forwards or backwards; timers and `advance` go on as before."""
        self.clock.jump(Duration(seconds=seconds))

    # Topics and their traffic.

    def _known(self, topic: str, message_type: type[Message] | None = None) -> str:
        """Return a topic's full name; refuse an unknown topic, or one of another type."""
        topic = checked_name(topic, "lab, in a call with a topic and then its type,", "topic")
        name, topics = absolute_name(topic), self.graph.bus.topics
        if name not in topics:
            raise NotSeen(f"{name} has no endpoint; {did_you_mean(name, topics, none='the graph has no topics')}")
        if message_type is not None and topics[name].type is not message_type:
            raise IncompatibleType(f"{name} carries {type_name(topics[name].type)}, not {type_name(message_type)}")
        return name

    def _refuse_forgotten(self, traffic: _Traffic, name: str, asked: int) -> None:
        """Refuse to pass the newest messages for all of them, unless the test asked for the newest."""
        kept = len(traffic.kept)
        if asked > kept and not self._only_newest:
            raise NotSeen(
                f"{asked} messages of {name} are asked for, and the newest {kept} are kept: "
                f"write harness(…, keep={asked}) to keep more of each topic, or a smaller number for the newest alone"
            )

    def _refuse_unheard(self, topic: str, message: Message) -> None:
        topic = checked_name(topic, "lab.publish(topic, message)", "topic")
        name, topics = absolute_name(topic), self.graph.bus.topics
        received = [each.name for each in topics.values() if each.subscriptions_added]
        if name not in received and not (self._loop.follows and name == CLOCK):
            anyway = f'lab.advertise({type(message).__name__}, "{topic}").publish(…) publishes it all the same'
            raise NotSeen(
                f"no node receives {name}; {did_you_mean(name, received, none='no topic is received')} ({anyway})"
            )

    def _why_nothing_came(self, name: str, timeout: float) -> str:
        topic = self.graph.bus.topics[name]
        publishers = ", ".join(f"{each.endpoint.node} ({each.published})" for each in topic.publishers) or "no node"
        lines = [f"nothing new on {name} within {timeout:g} virtual s; published by {publishers}"]
        lines += [f"failed: {failure.node} {failure.summary}" for failure in self.graph.failures]
        lines += [*str(self.ledger).splitlines(), *waiting(self._loop)]
        return "\n  ".join(lines)


def harness(
    *what: What,
    args: Mapping[str, object] | None = None,
    seed: int | None = None,
    expect_failure: type[Node] | str | None = None,
    keep: int | None = None,
    log_level: str = "info",
    record: Wanted = False,
) -> Harness:
    """Build a graph of launch files, node classes and instances, on virtual time.

    Args:
        what: As `busflow.launch` takes it.
        args: Values of the launch files' arguments.
        seed: What the nodes' random generators begin with; by default `BUSFLOW_SEED`, then the file's, then 0.
        expect_failure: The node that is to fail. Any other failure, or none, fails the test.
        keep: How many messages of each topic are kept, the newest. Unless it is given, 10,000 are kept, and `received`
            and `wait_for` raise where older ones are asked for.
        log_level: From where on `Harness.log` keeps lines, the newest 10,000.
        record: As `busflow.launch` takes it, but a test records only if this says so.
    """
    return Harness(
        *what,
        args=args,
        seed=seed,
        expect_failure=expect_failure,
        keep=keep,
        log_level=log_level,
        record=record,
    )


def given_seed() -> int | None:
    """Return the seed of `BUSFLOW_SEED`, to replay a failure; None where it is not set.

    Raises:
        BusflowError: It is not a number.
    """
    text = os.environ.get("BUSFLOW_SEED", "")
    if text and not text.isdecimal():
        raise BusflowError(f"BUSFLOW_SEED must be a whole number from 0, got {text!r}")
    return int(text) if text else None
