"""A bus against a model of it: whatever comes, goes, publishes, waits, takes or gives up, and in whatever order."""

import asyncio
from collections import deque
from dataclasses import dataclass, field

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from busflow.bus.bus import Bus
from busflow.bus.endpoint import Endpoint
from busflow.bus.publisher import Publisher
from busflow.bus.qos import Durability, Overflow, QoS
from busflow.bus.subscription import Subscription
from busflow.clock import SimClock
from busflow.errors import IncompatibleQoS, NotRunning, SendTimeout, WouldBlock
from busflow.msgs.std_msgs import Int64
from busflow.testing import VirtualLoop

TOPIC = "/number"
DEPTHS = st.integers(1, 3)
OVERFLOWS = st.sampled_from([Overflow.BLOCK, Overflow.BLOCK, Overflow.DROP_OLDEST, Overflow.DROP_NEWEST])
WHICH = st.integers(0, 5)  # of those there are; counted round where there are fewer
DURABILITIES = st.sampled_from([Durability.VOLATILE, Durability.TRANSIENT_LOCAL])


@dataclass(eq=False)
class Sender:
    """A publisher, and what it must keep for late joiners: the order on its topic, and the value."""

    end: Publisher
    kept: deque

    @property
    def latched(self):
        return self.end.endpoint.qos.durability is Durability.TRANSIENT_LOCAL


@dataclass(eq=False)
class Receiver:
    """A subscription, and what it must hold; one with a handler is handed everything when the loop turns."""

    end: Subscription
    kind: str
    handed: list
    open: bool = True
    queue: deque = field(default_factory=deque)
    arrived: list = field(default_factory=list)
    taken: list = field(default_factory=list)
    dropped: int = 0

    @property
    def qos(self):
        return self.end.endpoint.qos

    @property
    def pulled(self):
        return self.kind == "pulled"

    @property
    def full(self):
        return self.qos.overflow is Overflow.BLOCK and len(self.queue) >= self.qos.depth

    def push(self, value):
        self.arrived.append(value)
        if len(self.queue) >= self.qos.depth:
            assert self.qos.overflow is not Overflow.BLOCK
            self.dropped += 1
            if self.qos.overflow is Overflow.DROP_NEWEST:
                return
            self.queue.popleft()
        self.queue.append(value)


@dataclass(eq=False)
class Waiting:
    """A send that waits for room."""

    task: asyncio.Task
    sender: Sender
    value: int
    cancelled: bool = False


class BusModel(RuleBasedStateMachine):
    def __init__(self):
        super().__init__()
        self.runner = asyncio.Runner(loop_factory=VirtualLoop)
        self.loop = self.runner.get_loop()
        self.bus = self.runner.run(self.opened())
        self.senders = []
        self.receivers = []
        self.waiting = []
        self.pumps = []
        self.published = 0
        self.next_value = 0

    async def opened(self):
        bus = Bus(SimClock())
        bus.open()
        return bus

    def teardown(self):
        self.settle()
        self.runner.close()

    # Coming and going.

    @initialize(depth=DEPTHS, durability=DURABILITIES)
    def begin(self, depth, durability):
        """With room for one message, and two senders."""
        self.add_publisher(depth, durability)
        self.add_publisher(1, durability)
        self.add_subscription(1, Overflow.BLOCK, Durability.VOLATILE, "pulled")

    @precondition(lambda self: len(self.senders) < 3)
    @rule(depth=DEPTHS, durability=DURABILITIES)
    def add_publisher(self, depth, durability):
        latched = durability is Durability.TRANSIENT_LOCAL
        qos = QoS(depth=depth, durability=durability)
        publisher = Publisher(Int64, Endpoint("/source", TOPIC, Int64, qos, "source", TOPIC))
        asked_for = any(each.qos.durability is Durability.TRANSIENT_LOCAL for each in self.receivers)
        if asked_for and not latched:
            with pytest.raises(IncompatibleQoS):
                self.bus.attach_publisher(publisher)
            return
        self.bus.attach_publisher(publisher)
        self.senders.append(Sender(publisher, deque(maxlen=depth if latched else 0)))

    @precondition(lambda self: len(self.receivers) < 4)
    @rule(
        depth=DEPTHS,
        overflow=OVERFLOWS,
        durability=DURABILITIES,
        kind=st.sampled_from(["pulled", "plain", "async"]),
    )
    def add_subscription(self, depth, overflow, durability, kind):
        latched = durability is Durability.TRANSIENT_LOCAL
        qos = QoS(depth=depth, overflow=overflow, durability=durability)
        handed = []

        def take(message):
            handed.append(message.data)

        async def handle(message):
            take(message)

        handler = {"pulled": None, "plain": take, "async": handle}[kind]
        subscription = Subscription(Int64, Endpoint("/sink", TOPIC, Int64, qos, "sink", TOPIC), handler)
        if latched and not all(sender.latched for sender in self.senders):
            with pytest.raises(IncompatibleQoS):
                self.bus.attach_subscription(subscription, self.never_fails)
            return
        self.bus.attach_subscription(subscription, self.never_fails)
        receiver = Receiver(subscription, kind, handed)
        if latched:
            kept = sorted(entry for sender in self.senders for entry in sender.kept)
            for _, value in kept[-depth:]:
                receiver.push(value)
        self.open(receiver)
        self.receivers.append(receiver)

    @precondition(lambda self: self.senders)
    @rule(which=WHICH)
    def remove_publisher(self, which):
        sender = self.senders.pop(which % len(self.senders))
        sender.end.close()
        with pytest.raises(NotRunning):
            sender.end.publish(Int64(data=-1))

    @precondition(lambda self: self.receivers)
    @rule(which=WHICH)
    def remove_subscription(self, which):
        self.settle()
        receiver = self.receivers.pop(which % len(self.receivers))
        receiver.end.close()
        if receiver.pulled:
            assert [self.runner.run(anext(receiver.end)).data for _ in receiver.queue] == list(receiver.queue)
            with pytest.raises(StopAsyncIteration):
                self.runner.run(anext(receiver.end))
        self.settle()

    @precondition(lambda self: any(receiver.kind == "plain" for receiver in self.receivers))
    @rule(which=WHICH)
    def pause_or_open(self, which):
        receiver = self.one_of([receiver for receiver in self.receivers if receiver.kind == "plain"], which)
        if receiver.open:
            receiver.end.pause()
            receiver.open = False
        else:
            self.open(receiver)

    # Publishing.

    @precondition(lambda self: self.senders)
    @rule(which=WHICH, times=st.integers(1, 3))
    def publish(self, which, times):
        sender = self.one_of(self.senders, which)
        for _ in range(times):
            message = Int64(data=self.value())
            if self.waiting or any(receiver.full for receiver in self.receivers):
                with pytest.raises(WouldBlock):
                    sender.end.publish(message)
            else:
                sender.end.publish(message)
                self.deliver(sender, message.data)

    @precondition(lambda self: self.senders)
    @rule(which=st.lists(WHICH, min_size=1, max_size=3))
    def send(self, which):
        for each in which:
            sender, value = self.one_of(self.senders, each), self.value()
            task = self.loop.create_task(sender.end.send(Int64(data=value)))
            self.waiting.append(Waiting(task, sender, value))
        self.settle()

    @precondition(lambda self: self.waiting)
    @rule(which=WHICH)
    def cancel_a_waiting_send(self, which):
        send = self.one_of(self.waiting, which)
        send.task.cancel()
        send.cancelled = True

    @precondition(lambda self: self.waiting)
    @rule()
    def let_every_send_time_out(self):
        self.settle()
        self.runner.run(asyncio.sleep(6))
        for send in self.waiting:
            assert isinstance(send.task.exception(), SendTimeout)
        self.waiting.clear()

    # Receiving.

    @precondition(lambda self: any(receiver.pulled and receiver.queue for receiver in self.receivers))
    @rule(which=WHICH)
    def take(self, which):
        self.settle()
        receiver = self.one_of([each for each in self.receivers if each.pulled and each.queue], which)
        receiver.taken.append(receiver.queue.popleft())
        assert self.runner.run(anext(receiver.end)).data == receiver.taken[-1]
        self.settle()

    @precondition(lambda self: any(receiver.pulled for receiver in self.receivers))
    @rule(which=WHICH)
    def skip_to_the_latest(self, which):
        receiver = self.one_of([receiver for receiver in self.receivers if receiver.pulled], which)
        if receiver.queue:
            receiver.dropped += len(receiver.queue) - 1
            receiver.taken.append(receiver.queue[-1])
            receiver.queue.clear()
        latest = receiver.end.latest
        assert (latest and latest.data) == (receiver.taken[-1] if receiver.taken else None)

    @rule()
    def settle(self):
        """Let the loop turn until nothing is left: handlers are handed all, sends go on while there is room."""
        self.runner.run(self.loop.settle())
        for send in [send for send in self.waiting if send.cancelled]:
            assert send.task.cancelled()
            self.waiting.remove(send)
        self.hand_over()
        while self.waiting and not any(receiver.full for receiver in self.receivers):
            send = self.waiting.pop(0)
            if send.sender in self.senders:
                assert send.task.exception() is None
                self.deliver(send.sender, send.value)
            else:
                assert isinstance(send.task.exception(), NotRunning)
            self.hand_over()
        assert not any(send.task.done() for send in self.waiting)

    # The model.

    def value(self):
        self.next_value += 1
        return self.next_value

    def one_of(self, things, which):
        return things[which % len(things)]

    def deliver(self, sender, value):
        self.published += 1
        sender.kept.append((self.published, value))
        for receiver in self.receivers:
            receiver.push(value)

    def hand_over(self):
        """Give handlers all that waits; a lossy queue may have overflowed before its turn, or not, as the loop went."""
        for receiver in self.receivers:
            if not receiver.pulled and receiver.open:
                receiver.queue.clear()

    def open(self, receiver):
        pump = receiver.end.open()
        receiver.open = True
        if pump is not None:
            self.pumps.append(self.loop.create_task(pump))

    def never_fails(self, error, message):
        raise AssertionError(message) from error

    @invariant()
    def every_message_is_accounted_for(self):
        for line in self.bus.ledger():
            assert line.published == line.delivered + line.dropped + line.queued

    @invariant()
    def every_end_is_as_the_model_says(self):
        if TOPIC in self.bus.topics:
            assert self.bus.topics[TOPIC].published == self.published
            assert all(each.queued <= each.endpoint.qos.depth for each in self.bus.topics[TOPIC].subscriptions)
        for receiver in self.receivers:
            self.check(receiver)

    def check(self, receiver):
        statistics = receiver.end.statistics()
        assert statistics.published == len(receiver.arrived)
        assert [message.data for message in receiver.end.queue.items] == list(receiver.queue)
        if receiver.pulled:
            assert (statistics.delivered, statistics.dropped) == (len(receiver.taken), receiver.dropped)
            return
        assert statistics.delivered == len(receiver.handed)
        arrivals = iter(receiver.arrived)
        assert all(value in arrivals for value in receiver.handed), "handed over in another order, or twice"
        if receiver.qos.overflow is Overflow.BLOCK:
            assert receiver.handed + list(receiver.queue) == receiver.arrived


BusModel.TestCase.settings = settings(stateful_step_count=50)
TestBusModel = BusModel.TestCase
