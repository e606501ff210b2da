"""A bus against a model of it: whatever comes, goes, publishes, waits, takes or gives up, and in whatever order."""

import asyncio
import threading
from collections import Counter, deque
from dataclasses import dataclass, field

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from busflow.bus.bus import BusObserver
from busflow.bus.events import MessageLost, PublisherMatched, SubscriptionMatched
from busflow.bus.expiry import message_of
from busflow.bus.publisher import Publisher
from busflow.bus.qos import Durability, Overflow
from busflow.bus.subscription import Subscription
from busflow.errors import IncompatibleQoS, NotRunning, Occupied, SendTimeout, WouldBlock
from busflow.msgs.std_msgs import Int64
from busflow.testing import VirtualLoop
from tests.conftest import Bench

TOPIC = "/number"
DEPTHS = st.integers(1, 3)
OVERFLOWS = st.sampled_from([Overflow.BLOCK, Overflow.BLOCK, Overflow.DROP_OLDEST, Overflow.DROP_NEWEST])
KINDS = st.sampled_from(["pulled", "plain", "async"])
FLAGS = st.booleans()
WHICH = st.integers(0, 5)  # of those there are; counted round where there are fewer
DURABILITIES = st.sampled_from([Durability.VOLATILE, Durability.TRANSIENT_LOCAL])
LIFESPANS_S = st.sampled_from([None, 1.03])
NEVER = float("inf")
TIMEOUT_S = 5.0


@dataclass(eq=False)
class Item:
    """A message, and the time in seconds at which it expires."""

    value: int
    expires_s: float


@dataclass(eq=False)
class Sender:
    """A publisher, and its history for late joiners: the order on its topic, and the message."""

    end: Publisher
    kept: deque
    lifespan_s: float
    published: int = 0
    events: list = field(default_factory=list)

    @property
    def latched(self):
        return self.end.endpoint.qos.durability is Durability.TRANSIENT_LOCAL


@dataclass(eq=False)
class Receiver:
    """A subscription and its expected state; one with a handler is handed everything when the loop turns."""

    end: Subscription
    kind: str
    fails: bool = False
    open: bool = True
    queue: deque = field(default_factory=deque)
    arrived: int = 0
    taken: list = field(default_factory=list)
    drops: Counter = field(default_factory=Counter)
    handed: list = field(default_factory=list)
    former: int = 0
    reasons: list | None = None
    events: list = field(default_factory=list)
    losses_before: int = 0
    latest: int | None = None
    reader: asyncio.Task | None = None

    @property
    def qos(self):
        return self.end.endpoint.qos

    @property
    def pulled(self):
        return self.kind == "pulled"

    @property
    def full(self):
        return self.qos.overflow is Overflow.BLOCK and len(self.queue) >= self.qos.depth

    def push(self, item):
        self.arrived += 1
        if len(self.queue) >= self.qos.depth:
            assert self.qos.overflow is not Overflow.BLOCK
            self.drops["overflow"] += 1
            if self.qos.overflow is Overflow.DROP_NEWEST:
                return
            self.queue.popleft()
        self.queue.append(item)

    def take(self):
        self.latest = self.queue.popleft().value
        self.taken.append(self.latest)
        return self.latest

    def expire(self, now_s):
        fresh = [item for item in self.queue if item.expires_s > now_s]
        self.drops["expired"] += len(self.queue) - len(fresh)
        self.queue = deque(fresh)


@dataclass(eq=False)
class Waiting:
    """A send that waits for room."""

    task: asyncio.Task
    sender: Sender
    value: int
    until_s: float
    cancelled: bool = False


class Observer(BusObserver):
    """Notes the values that each subscription hands over."""

    def __init__(self, values):
        self.values = values

    def subscription_added(self, subscription):
        subscription.observe(lambda message: self.values.setdefault(subscription, []).append(message.data))


class BusModel(RuleBasedStateMachine):
    def __init__(self):
        super().__init__()
        self.observed = {}
        self.runner = asyncio.Runner(loop_factory=VirtualLoop)
        self.loop = self.runner.get_loop()
        self.loop.set_task_factory(None)  # the usual one looks at all frames below, and they are many
        self.run = self.loop.run_until_complete
        self.bench = self.run(self.call(Bench))
        self.bus = self.bench.bus
        self.bus.observe(Observer(self.observed))
        self.senders, self.receivers, self.waiting, self.gone, self.failed = [], [], [], [], []
        self.tapped, self.values = [], []
        self.refused = self.next_value = 0

    async def call(self, act):
        return act()

    def on_the_loop(self, act):
        """Call it on the loop, which has nothing else to do."""
        self.settle()
        return self.run(self.call(act))

    def teardown(self):
        try:
            self.settle()
        finally:
            self.runner.close()

    # Coming and going.

    @initialize(
        depth=DEPTHS,
        durability=DURABILITIES,
        lifespan_s=LIFESPANS_S,
        overflow=OVERFLOWS,
        kind=KINDS,
        fails=FLAGS,
    )
    def begin(self, depth, durability, lifespan_s, overflow, kind, fails):
        """With two senders and a receiver."""
        self.add_publisher(depth, durability, lifespan_s)
        self.add_publisher(1, durability, None)
        self.add_subscription(depth, overflow, Durability.VOLATILE, kind, fails=fails, listens=False)
        topic = self.bus.topics[TOPIC]
        self.bus.tap(topic, lambda message: self.tapped.append(message.data))
        self.bus.keep_recent(topic, 2)

    @precondition(lambda self: len(self.senders) < 3)
    @rule(depth=DEPTHS, durability=DURABILITIES, lifespan_s=LIFESPANS_S)
    def add_publisher(self, depth, durability, lifespan_s):
        latched = durability is Durability.TRANSIENT_LOCAL

        def add():
            return self.bench.publisher(TOPIC, depth=depth, durability=durability, lifespan_s=lifespan_s)

        if not latched and any(each.qos.durability is Durability.TRANSIENT_LOCAL for each in self.receivers):
            with pytest.raises(IncompatibleQoS):
                self.on_the_loop(add)
            return
        sender = Sender(self.on_the_loop(add), deque(maxlen=depth if latched else 0), lifespan_s or NEVER)
        self.listen(sender)
        self.senders.append(sender)

    @precondition(lambda self: len(self.receivers) < 4)
    @rule(
        depth=DEPTHS,
        overflow=OVERFLOWS,
        durability=DURABILITIES,
        kind=KINDS,
        fails=FLAGS,
        listens=FLAGS,
    )
    def add_subscription(self, depth, overflow, durability, kind, fails, listens):
        latched = durability is Durability.TRANSIENT_LOCAL
        receiver = Receiver(None, kind, fails=fails)

        def add():
            return self.bench.subscription(
                self.handler(receiver), TOPIC, depth=depth, overflow=overflow, durability=durability
            )

        if latched and not all(sender.latched for sender in self.senders):
            with pytest.raises(IncompatibleQoS):
                self.on_the_loop(add)
            return
        receiver.end = self.on_the_loop(add)
        if latched:
            kept = sorted((entry for sender in self.senders for entry in sender.kept), key=lambda entry: entry[0])
            for _, item in [entry for entry in kept if entry[1].expires_s > self.loop.time()][-depth:]:
                receiver.push(item)
        if listens:
            receiver.reasons = []
            receiver.losses_before = receiver.drops["overflow"]
            receiver.end.observe_drops(receiver.reasons.append)
            receiver.end.report_losses()
        self.listen(receiver)
        self.receivers.append(receiver)
        self.settle()

    def handler(self, receiver):
        """The handler of a receiver's kind; one that fails does so with each fourth value."""

        def take(message):
            receiver.handed.append(message.data)
            if receiver.fails and message.data % 4 == 0:
                raise ZeroDivisionError

        async def handle(message):
            take(message)

        return {"pulled": None, "plain": take, "async": handle}[receiver.kind]

    def listen(self, one):
        one.events = []
        one.end.on_event = one.events.append
        one.end.report_changes()

    @precondition(lambda self: self.senders)
    @rule(which=WHICH, again=FLAGS)
    def remove_publisher(self, which, again):
        if again:
            self.restart_publisher(which)
            return
        sender = self.senders.pop(which % len(self.senders))
        sender.end.close()
        self.check_silence(sender)
        with pytest.raises(NotRunning):
            sender.end.publish(Int64(data=-1))

    def check_silence(self, one):
        """An end that has left reports no change."""
        one.events.clear()
        one.end.report_changes()
        assert one.events == []

    def restart_publisher(self, which):
        """The successor keeps history and counts; a send of the former one fails."""
        at = which % len(self.senders)
        before = self.senders[at]
        end = Publisher(Int64, before.end.endpoint)
        self.on_the_loop(lambda: self.bus.attach_publisher(end, before.end))
        self.senders[at] = Sender(end, before.kept, before.lifespan_s, before.published)
        self.listen(self.senders[at])
        with pytest.raises(NotRunning):
            before.end.publish(Int64(data=-1))

    @precondition(lambda self: self.receivers)
    @rule(which=WHICH, again=FLAGS, discard=FLAGS)
    def remove_subscription(self, which, again, discard):
        if again:
            self.restart_subscription(which)
            return
        self.settle()
        receiver = self.receivers.pop(which % len(self.receivers))
        if discard:
            self.check(receiver)
            receiver.end.discard_expired()
            receiver.end.discard_queued("stopped")
            receiver.drops["stopped"] += len(receiver.queue)
            receiver.queue.clear()
        receiver.end.close()
        self.check_silence(receiver)
        self.gone.append((receiver.arrived, len(receiver.taken), sum(receiver.drops.values()), len(receiver.queue)))
        if receiver.reader:
            self.end_reader(receiver)
        elif receiver.pulled:
            found = [self.run(anext(receiver.end)).data for _ in receiver.queue]
            assert found == [item.value for item in receiver.queue]
            with pytest.raises(StopAsyncIteration):
                self.run(anext(receiver.end))
        self.settle()

    def restart_subscription(self, which):
        """The successor keeps queue and counts."""
        receiver = self.one_of(self.receivers, which)
        end = Subscription(Int64, receiver.end.endpoint, self.handler(receiver))
        self.on_the_loop(lambda: self.bus.attach_subscription(end, self.note_failure, receiver.end))
        receiver.end, receiver.latest, receiver.reasons, receiver.former = end, None, None, len(receiver.taken)
        if receiver.reader:
            self.end_reader(receiver)
        self.open(receiver)
        self.listen(receiver)

    def end_reader(self, receiver):
        with pytest.raises(StopAsyncIteration):
            self.run(asyncio.wait_for(receiver.reader, None))
        receiver.reader = None

    @precondition(lambda self: any(not receiver.pulled for receiver in self.receivers))
    @rule(which=WHICH)
    def pause_or_open(self, which):
        receiver = self.one_of([receiver for receiver in self.receivers if not receiver.pulled], which)
        if not receiver.open:
            self.open(receiver)
        elif receiver.kind == "plain":
            receiver.end.pause()
            receiver.open = False

    # Publishing.

    @precondition(lambda self: self.senders)
    @rule(which=WHICH, times=st.integers(1, 3))
    def publish(self, which, times):
        sender = self.one_of(self.senders, which)
        for _ in range(times):
            message = Int64(data=self.value())
            if self.blocked:
                with pytest.raises(WouldBlock):
                    sender.end.publish(message)
            else:
                sender.end.publish(message)
                self.deliver(sender, message.data)

    publish_more = publish  # twice as often as other rules

    @precondition(lambda self: self.senders)
    @rule(which=WHICH, times=st.integers(1, 3))
    def publish_from_a_thread(self, which, times):
        self.settle()
        sender, values = self.one_of(self.senders, which), [self.value() for _ in range(times)]
        thread = threading.Thread(target=lambda: [sender.end.publish(Int64(data=value)) for value in values])
        thread.start()
        thread.join(60)
        assert self.bus.inbox.statistics().waiting == times
        for value in values:
            if self.blocked:
                self.refused += 1
            else:
                self.deliver(sender, value)
        self.settle()

    @precondition(lambda self: self.senders)
    @rule(which=st.lists(WHICH, min_size=1, max_size=3))
    def send(self, which):
        """Begin several sends at once; those with room need not wait for handlers."""
        self.settle()
        sent = []
        for each in which:
            sender, value = self.one_of(self.senders, each), self.value()
            task = self.loop.create_task(sender.end.send(Int64(data=value)))
            if self.blocked:
                self.waiting.append(Waiting(task, sender, value, self.loop.time() + TIMEOUT_S))
            else:
                self.deliver(sender, value)
                sent.append(task)
        self.settle()
        assert [task.exception() for task in sent] == [None] * len(sent)

    @precondition(lambda self: self.waiting)
    @rule(which=WHICH)
    def cancel_a_waiting_send(self, which):
        send = self.one_of(self.waiting, which)
        send.task.cancel()
        send.cancelled = True

    @rule(step_s=st.sampled_from([0.4, 0.4, 6.4]))
    def let_time_pass(self, step_s):
        """Messages expire, sends get their room, and those that wait too long time out."""
        self.settle()
        end_s = self.loop.time() + step_s
        while (now_s := self.loop.time()) < end_s:
            expiries = [item.expires_s for receiver in self.receivers for item in receiver.queue]
            next_s = min([end_s, *expiries, *(send.until_s for send in self.waiting)])
            self.run(asyncio.sleep(next_s - now_s))
            for send in [send for send in self.waiting if send.until_s <= next_s]:
                assert isinstance(send.task.exception(), SendTimeout)
                self.waiting.remove(send)
            for receiver in self.receivers:
                receiver.expire(self.loop.time())
            self.settle()

    # Receiving.

    @precondition(lambda self: any(each.pulled and each.queue and not each.reader for each in self.receivers))
    @rule(which=WHICH)
    def take(self, which):
        self.settle()
        ready = [each for each in self.receivers if each.pulled and each.queue and not each.reader]
        receiver = self.one_of(ready, which)
        expected = receiver.take()
        assert self.run(anext(receiver.end)).data == expected
        self.settle()

    take_more = take

    @precondition(lambda self: any(each.pulled and not each.queue for each in self.receivers))
    @rule(which=WHICH)
    def wait_for_a_message_or_give_up(self, which):
        self.settle()
        empty = [each for each in self.receivers if each.pulled and not each.queue]
        if not empty:
            return
        receiver = self.one_of(empty, which)
        if receiver.reader:
            receiver.reader.cancel()
            receiver.reader = None
        else:
            receiver.reader = self.loop.create_task(anext(receiver.end))
            self.settle()
            with pytest.raises(Occupied):
                self.run(anext(receiver.end))

    @precondition(lambda self: any(receiver.pulled for receiver in self.receivers))
    @rule(which=WHICH)
    def skip_to_the_latest(self, which):
        receiver = self.one_of([receiver for receiver in self.receivers if receiver.pulled], which)
        if receiver.queue:
            receiver.drops["superseded"] += len(receiver.queue) - 1
            receiver.queue = deque([receiver.queue[-1]])
            receiver.take()
        latest = receiver.end.latest
        assert (latest and latest.data) == receiver.latest

    def settle(self):
        """Let the loop turn until nothing is left: handlers are handed all, sends go on while there is room."""
        self.run(self.loop.settle())
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
        for receiver in self.receivers:
            self.check(receiver, settled=True)
        assert [(type(error), message.data) for error, message in self.bench.failures] == self.failed

    # The model.

    @property
    def blocked(self):
        return bool(self.waiting) or any(receiver.full for receiver in self.receivers)

    def value(self):
        self.next_value += 1
        return self.next_value

    def one_of(self, things, which):
        return things[which % len(things)]

    def deliver(self, sender, value):
        item = Item(value, self.loop.time() + sender.lifespan_s)
        self.values.append(value)
        sender.published += 1
        sender.kept.append((len(self.values), item))
        for receiver in self.receivers:
            receiver.push(item)

    def hand_over(self):
        """Give handlers and readers their messages; a handler that fails gets no more."""
        for receiver in self.receivers:
            if receiver.reader and receiver.queue:
                assert receiver.reader.result().data == receiver.take()
                receiver.reader = None
            while not receiver.pulled and receiver.open and receiver.queue:
                if receiver.take() % 4 == 0 and receiver.fails:
                    receiver.open = False
                    self.failed.append((ZeroDivisionError, receiver.latest))

    def open(self, receiver):
        pump = self.on_the_loop(receiver.end.open)
        receiver.open = True
        if pump is not None:
            self.bench.pumps.append(self.loop.create_task(pump))
        self.settle()

    def note_failure(self, error, message):
        self.bench.failures.append((error, message))

    @invariant()
    def every_message_is_accounted_for(self):
        assert self.bench.balanced()
        assert self.bus.inbox.refused == self.refused
        if TOPIC not in self.bus.topics:
            return
        topic = self.bus.topics[TOPIC]
        assert (topic.published, self.tapped) == (len(self.values), self.values)
        assert topic.recent is None or [message_of(item).data for item in topic.recent] == self.values[-2:]
        lines = list(self.bus.ledger())
        there = [(each.arrived, each.end.delivered, each.end.drops.total(), each.end.queued) for each in self.receivers]
        totals = [sum(column) for column in zip(*there, *self.gone, strict=True)]
        assert totals == [sum(getattr(line, name) for line in lines) for name in COLUMNS] or not lines
        assert sum(line.published for line in topic.gone) == sum(arrived for arrived, *_ in self.gone)

    @invariant()
    def every_end_is_as_the_model_says(self):
        for sender in self.senders:
            found = sender.end.statistics()
            assert (found.published, found.kept) == (sender.published, len(sender.kept))
            assert found.subscriptions == len(self.receivers)
            self.check_matches(sender, PublisherMatched, len(self.receivers))
        for receiver in self.receivers:
            self.check(receiver)
            self.check_matches(receiver, SubscriptionMatched, len(self.senders))

    def check(self, receiver, *, settled=False):
        """Compare with the model; the bus drops an expired message only when it needs the room or takes it."""
        found, items = receiver.end.statistics(), receiver.end.queue.items
        fresh = [item for item in items if getattr(item, "expires_ns", NEVER) > self.loop.time_ns()]
        assert found.published == receiver.arrived
        assert found.queued == len(items) <= receiver.qos.depth
        drops = Counter(found.drops)
        if receiver.reasons is not None:
            assert Counter(receiver.reasons) == drops - Counter(overflow=receiver.losses_before)
        drops["expired"] += len(items) - len(fresh)
        if receiver.pulled or settled:  # handlers are handed messages when the loop turns
            assert [message_of(item).data for item in fresh] == [item.value for item in receiver.queue]
            assert (drops, found.delivered) == (receiver.drops, len(receiver.taken))
            assert self.observed.get(receiver.end, []) == receiver.taken[receiver.former :]
            assert receiver.pulled or receiver.handed == receiver.taken
        if settled and receiver.reasons is not None:
            lost = [event.total_change for event in receiver.events if isinstance(event, MessageLost)]
            assert sum(lost) == receiver.drops["overflow"]

    def check_matches(self, one, kind, current):
        matched = [event for event in one.events if isinstance(event, kind)]
        assert sum(event.current_change for event in matched) == current
        assert not matched or matched[-1].current == current
        assert sum(event.total_change for event in matched) == (matched[-1].total if matched else 0)


COLUMNS = ("published", "delivered", "dropped", "queued")
BusModel.TestCase.settings = settings(stateful_step_count=50, max_examples=max(60, settings().max_examples))
TestBusModel = BusModel.TestCase
