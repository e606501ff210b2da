"""Pairs of nodes that show one promise each, wherever they run; `contract.yaml` places them.

A node of a pair logs a line, `outcome`, with the facts that the contract tests compare.
"""

import asyncio
from collections.abc import Awaitable

from pydantic import Field

from busflow import (
    ActionType,
    DeadlineMissed,
    GoalAborted,
    GoalCanceled,
    GoalRejected,
    LivelinessChanged,
    Message,
    Node,
    Parameters,
    PublisherMatched,
    QoS,
    RunningGoal,
    ServiceError,
    SubscriptionMatched,
    action,
    action_client,
    client,
    on_event,
    on_parameters,
    publisher,
    service,
    subscription,
)
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.msgs.std_msgs import Float64, Int64
from busflow.msgs.std_srvs import SetBool, Trigger

LATCHED = QoS(depth=3, durability="transient_local")


class CountParameters(Parameters):
    """How many numbers a node publishes or waits for."""

    count: int = 300


class NumberPublisher(Node):
    """Publishes numbers at once, the first thing that it does."""

    parameters: CountParameters
    numbers = publisher(Int64, "numbers")

    async def start(self) -> None:
        self.log.info("draws", number=int(self.rng.integers(1 << 40)))

    async def run(self) -> None:
        for number in range(self.parameters.count):
            self.numbers.publish(Int64(data=number))


class NumberReader(Node):
    """Collects the numbers until it has all of them."""

    parameters: CountParameters

    async def start(self) -> None:
        self.log.info("draws", number=int(self.rng.integers(1 << 40)))
        self.received: list[int] = []

    @subscription("numbers", qos=QoS(depth=1000))
    def on_number(self, number: Int64) -> None:
        self.received.append(number.data)
        if len(self.received) == self.parameters.count:
            self.log.info("outcome", in_order=self.received == [*range(self.parameters.count)])


class PromptedPublisher(NumberPublisher):
    """Publishes its first number, and all others at once when a reader asks: early ones would fill its depth."""

    async def run(self) -> None:
        self.numbers.publish(Int64(data=0))

    @service(Trigger, "others")
    def others(self, _request: Trigger.Request) -> Trigger.Response:
        for number in range(1, self.parameters.count):
            self.numbers.publish(Int64(data=number))
        return Trigger.Response(success=True)


class SlowReader(Node):
    """Handles its first number until all others have come."""

    numbers = subscription(Int64, "numbers", qos=QoS(depth=5))
    others = client(Trigger, "others")

    async def run(self) -> None:
        received: list[int] = []
        async for number in self.numbers:
            if number.data == 0:
                await self.others.call()
            while self.numbers.published < 21:
                await self.clock.sleep(0.01)
            received.append(number.data)
            if number.data == 20:
                self.log.info("outcome", newest=str(received[-5:]))


class LatchedPublisher(Node):
    """Publishes before anybody can have subscribed, and says so."""

    numbers = publisher(Int64, "numbers", qos=LATCHED)

    async def start(self) -> None:
        for number in range(5):
            self.numbers.publish(Int64(data=number))

    @service(Trigger, "published")
    def published(self, _request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)


class LateReader(Node):
    """Subscribes once everything is published."""

    published = client(Trigger, "published")

    async def run(self) -> None:
        self.received: list[int] = []
        await self.published.call()
        self.create_subscription(Int64, "numbers", self.on_number, qos=QoS(depth=10, durability="transient_local"))

    def on_number(self, number: Int64) -> None:
        self.received.append(number.data)
        if number.data == 4 and self.received.count(4) == 1:
            self.log.info("outcome", received=str(self.received))


class ExpiringPublisher(Node):
    """Says that it has published once its first number has expired, and publishes the last one over and over."""

    numbers = publisher(Int64, "numbers", qos=QoS(depth=3, durability="transient_local", lifespan=0.1))

    async def start(self) -> None:
        self.numbers.publish(Int64(data=1))

    @service(Trigger, "published")
    async def published(self, _request: Trigger.Request) -> Trigger.Response:
        await self.clock.sleep(0.2)
        self.spawn(self.repeat())
        return Trigger.Response(success=True)

    async def repeat(self) -> None:
        while True:
            self.numbers.publish(Int64(data=4))
            await self.clock.sleep(0.1)


class FirstPlayer(Node):
    """Returns each number, raised by one."""

    there = publisher(Int64, "there")

    async def run(self) -> None:
        self.there.publish(Int64(data=0))

    @subscription("back")
    def on_number(self, number: Int64) -> None:
        self.there.publish(Int64(data=number.data + 1))


class SecondPlayer(Node):
    """Returns each number, up to 200."""

    back = publisher(Int64, "back")

    @subscription("there")
    def on_number(self, number: Int64) -> None:
        if number.data == 200:
            self.log.info("outcome", last=number.data)
        else:
            self.back.publish(number)


class SilentPublisher(Node):
    """Promises more than it keeps: one message on each topic."""

    promised = publisher(Int64, "promised", qos=QoS(deadline=0.1))
    alive = publisher(Int64, "alive", qos=QoS(liveliness="manual_by_topic", lease=0.2))

    async def run(self) -> None:
        self.promised.publish(Int64(data=1))
        self.alive.publish(Int64(data=1))

    @on_event("promised")
    def on_matched(self, event: PublisherMatched) -> None:
        if event.current:
            self.log.info("outcome", matched=event.current)


class EventReader(Node):
    """Notes the first event of each kind."""

    async def start(self) -> None:
        self.events: set[str] = set()

    def note(self, event: str) -> None:
        if event not in self.events and len(self.events | {event}) == 4:
            self.log.info("outcome", events=str(sorted(self.events | {event})))
        self.events.add(event)

    @subscription("promised", qos=QoS(deadline=0.2))
    def on_promised(self, number: Int64) -> None:
        self.note(f"received {number.data}")

    @subscription("alive", qos=QoS(liveliness="manual_by_topic", lease=0.5))
    def on_alive(self, _number: Int64) -> None: ...

    @on_event("promised")
    def on_matched(self, event: SubscriptionMatched) -> None:
        if event.current:
            self.note(f"matched {event.current}")

    @on_event("promised")
    def on_deadline(self, _event: DeadlineMissed) -> None:
        self.note("deadline missed")

    @on_event("alive")
    def on_liveliness(self, event: LivelinessChanged) -> None:
        if not event.alive:
            self.note("lease ended")


class Server(Node):
    """Answers, fails, never answers, and fails as a node at a message."""

    async def start(self) -> None:
        self.begun, self.leaves = asyncio.Event(), asyncio.Event()

    @service(SetBool, "switch")
    async def switch(self, request: SetBool.Request) -> SetBool.Response:
        if not request.data:
            raise ValueError("it stays on")
        return SetBool.Response(success=True, message="on")

    @service(Trigger, "never")
    async def never(self, _request: Trigger.Request) -> Trigger.Response:
        return await asyncio.Event().wait() and Trigger.Response()

    @service(Trigger, "full", depth=1)
    async def full(self, _request: Trigger.Request) -> Trigger.Response:
        self.begun.set()
        return await asyncio.Event().wait() and Trigger.Response()

    @service(Trigger, "has_begun")
    async def has_begun(self, _request: Trigger.Request) -> Trigger.Response:
        await self.begun.wait()
        return Trigger.Response(success=True)

    @subscription("leave")
    def on_leave(self, _number: Int64) -> None:
        self.leaves.set()

    async def run(self) -> None:
        await self.leaves.wait()
        raise RuntimeError("gone")


class Client(Node):
    """Makes a call that succeeds, and calls that fail in every way."""

    switch, never, full = client(SetBool, "switch"), client(Trigger, "never"), client(Trigger, "full")
    has_begun, nobody = client(Trigger, "has_begun"), client(Trigger, "nobody")
    leave = publisher(Int64, "leave")

    async def run(self) -> None:
        answer = await self.switch.call(SetBool.Request(data=True))
        found = [
            answer.message,
            await error_of(self.nobody.call()),
            await error_of(self.switch.call(SetBool.Request(data=False))),
            await error_of(self.never.call(timeout=0.2)),
        ]
        waiting = [asyncio.ensure_future(error_of(self.full.call()))]
        await self.has_begun.call()
        waiting.append(asyncio.ensure_future(error_of(self.full.call())))
        await asyncio.sleep(0)
        found.append(await error_of(self.full.call()))
        self.leave.publish(Int64(data=0))
        self.log.info("outcome", found=str([*found, *[await each for each in waiting]]))


async def error_of(call: Awaitable[object]) -> str:
    """The class of the error with which a call ends."""
    try:
        return str(await call)
    except ServiceError as error:
        return type(error).__name__


class MoveTo(ActionType, package="contract"):
    """Moves a joint."""

    class Goal(Message):
        """The angle to reach."""

        angle: float = 0.0

    class Result(Message):
        """The angle that was reached."""

        angle: float = 0.0

    class Feedback(Message):
        """The angle that is left."""

        left: float = 0.0


class Arm(Node):
    """Moves by one degree each 10 ms; a goal beyond one turn never begins, so it has no feedback."""

    @action(MoveTo, "move", when_busy="parallel")
    async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
        angle = 0.0
        if goal.request.angle < 0:
            raise ValueError("no way back")
        try:
            if goal.request.angle > 360:
                await asyncio.Event().wait()
            while angle < goal.request.angle:
                await self.clock.sleep(0.01)
                angle += 1
                goal.feedback(MoveTo.Feedback(left=goal.request.angle - angle))
        except asyncio.CancelledError:
            return MoveTo.Result(angle=-1)
        return MoveTo.Result(angle=angle)

    @move.accepts
    def reachable(self, request: MoveTo.Goal) -> bool | str:
        return request.angle <= 100_000 or "out of reach"


class Boss(Node):
    """Sends a goal that is reached, one that is canceled, one that is rejected and one that fails."""

    move = action_client(MoveTo, "move")

    async def run(self) -> None:
        await self.move.ready()
        left: list[float] = []
        result = await self.move.run(MoveTo.Goal(angle=5), on_feedback=lambda each: left.append(each.left))
        found = [str(result.angle), str(left)]
        async with self.move.send(MoveTo.Goal(angle=90_000)) as going:
            await going.cancel()
            try:
                await going.result()
            except GoalCanceled as error:
                found.append(f"GoalCanceled at {error.result.angle}")
        for angle in (1e6, -1):
            try:
                await self.move.run(MoveTo.Goal(angle=angle))
            except (GoalRejected, GoalAborted) as error:
                found.append(type(error).__name__)
        self.log.info("outcome", found=str(found))


class TunedParameters(Parameters):
    """Of which one has a limit."""

    gain: float = Field(default=1.0, ge=0)


class Tuned(Node):
    """Publishes the sum of its former and its new gain."""

    parameters: TunedParameters
    sums = publisher(Float64, "sums")

    @on_parameters
    def on_change(self, old: TunedParameters) -> None:
        self.sums.publish(Float64(data=old.gain + self.parameters.gain))


class ParameterWatcher(Node):
    """Waits for the change of a parameter, as it is announced and as the node itself acts on it."""

    async def start(self) -> None:
        self.seen: set[str] = set()

    def note(self, seen: str) -> None:
        self.seen.add(seen)
        if len(self.seen) == 2:
            self.log.info("outcome", seen=str(sorted(self.seen)))

    @subscription("/parameter_events")
    def on_change(self, event: ParameterEvent) -> None:
        for each in event.changed_parameters:
            self.note(f"{event.node} {each.name} {each.value.double_value}")

    @subscription("sums")
    def on_sum(self, value: Float64) -> None:
        self.note(f"sum {value.data}")


class Fragile(Node):
    """Fails at a message."""

    numbers = publisher(Int64, "numbers")

    async def run(self) -> None:
        for number in (1, 2):
            self.numbers.publish(Int64(data=number))

    @subscription("fail")
    def on_fail(self, _number: Int64) -> None:
        raise ValueError("told to")


class Breaker(Node):
    """Ends the first life of the other node, and waits for the second."""

    fail = publisher(Int64, "fail")

    async def start(self) -> None:
        self.received: list[int] = []

    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        self.received.append(number.data)
        if len(self.received) == 2:
            self.fail.publish(Int64())
        if len(self.received) == 4:
            self.log.info("outcome", received=str(self.received))
