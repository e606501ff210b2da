"""`@on_parameters`: called after a change, one call at a time, and a failure there is the node's."""

import asyncio

from busflow import Node, Parameters, QoS, on_event, on_parameters, publisher, subscription, timer
from busflow.bus.events import DeadlineMissed
from busflow.errors import InvalidDeclaration
from busflow.msgs.std_msgs import Float64, Int64
from busflow.node.node import runtime_of
from busflow.testing import explore, harness, virtual_time


class Gains(Parameters):
    gain: float = 1.0


class Controller(Node):
    parameters: Gains

    output = publisher(Float64, "output")

    @on_parameters
    def retune(self, old: Gains) -> None:
        self.output.publish(Float64(data=self.parameters.gain - old.gain))


@virtual_time
async def test_handler_of_a_change_runs_before_set_returns():
    async with harness(Controller) as lab:
        lab.set_parameters(Controller, gain=3)
        assert [each.data for each in lab.received("output")] == [2.0]


@virtual_time
async def test_a_method_that_overrides_it_is_called_instead():
    class Louder(Controller):
        def retune(self, old: Gains) -> None:
            self.output.publish(Float64(data=100.0 * old.gain))

    async with harness(Louder) as lab:
        lab.set_parameters(Louder, gain=3)
        assert [each.data for each in lab.received("output")] == [100.0]


@virtual_time
async def test_a_raising_callback_fails_the_node_after_change():
    class Failing(Node):
        parameters: Gains

        @on_parameters
        def retune(self, old: Gains) -> None:
            raise RuntimeError(f"no such gain, keep {old.gain}")

    async with harness(Failing, expect_failure=Failing) as lab:
        assert lab.set_parameters(Failing, gain=3) == ("gain",)
        assert lab.node(Failing).parameters.gain == 3
        (failure,) = lab.graph.failures
        assert failure.origin == "Failing.retune (parameters)"


@virtual_time
async def test_what_an_async_callback_raises_fails_the_node():
    class Failing(Node):
        parameters: Gains

        @on_parameters
        async def retune(self, old: Gains) -> None:
            raise RuntimeError(f"keep {old.gain}")

    async with harness(Failing, expect_failure=Failing) as lab:
        lab.set_parameters(Failing, gain=3)
        await lab.settle()
        (failure,) = lab.graph.failures
        assert (failure.origin, str(failure.error)) == ("Failing.retune (parameters)", "keep 1.0")


class Slow(Node):
    parameters: Gains

    async def start(self) -> None:
        self.heard: list[tuple[float, float]] = []
        self.calls = 0

    @on_parameters
    async def retune(self, old: Gains) -> None:
        self.calls += 1
        assert self.calls == 1, "one call at a time"
        self.heard.append((old.gain, self.parameters.gain))
        await self.clock.sleep(1)
        self.calls -= 1


@virtual_time
async def test_changes_while_it_awaits_make_one_more_call():
    async with harness(Slow) as lab:
        for gain in (2, 3, 4):
            lab.set_parameters(Slow, gain=gain)
            await lab.advance(0.1)
        await lab.advance(5)
        assert lab.node(Slow).heard == [(1.0, 2.0), (2.0, 4.0)]


@virtual_time
async def test_an_async_handler_sees_changes_where_it_awaits():
    class Reader(Node):
        parameters: Gains

        @timer(1)
        async def read(self) -> None:
            self.before = self.parameters.gain
            await self.clock.sleep(0.5)
            self.after = self.parameters.gain

    async with harness(Reader) as lab:
        await lab.advance(1.2)
        lab.set_parameters(Reader, gain=7)
        await lab.advance(0.5)
        assert (lab.node(Reader).before, lab.node(Reader).after) == (1.0, 7.0)


@virtual_time
async def test_change_during_start_is_handled_once_open():
    class Late(Node):
        parameters: Gains

        async def start(self) -> None:
            self.gain = self.parameters.gain
            await self.clock.sleep(1)

        @on_parameters
        def retune(self, old: Gains) -> None:
            assert old.gain == self.gain
            self.gain = self.parameters.gain

    lab = harness(Late)
    entered = asyncio.create_task(lab.__aenter__())
    await asyncio.sleep(0.5)
    lab.set_parameters(Late, gain=5)
    assert lab.node(Late).gain == 1.0
    await entered
    assert lab.node(Late).gain == 5.0
    await lab.__aexit__(None, None, None)


@virtual_time
async def test_a_handler_may_set_parameters_itself():
    class Limited(Node):
        parameters: Gains

        @on_parameters
        def retune(self, old: Gains) -> None:
            self.seen = [*getattr(self, "seen", []), (old.gain, self.parameters.gain)]
            if self.parameters.gain > 10:
                self.graph.set_parameters(self, gain=10)

    lab = harness(Limited)
    async with lab:
        lab.node(Limited).graph = lab.graph
        lab.set_parameters(Limited, gain=50)
        assert lab.node(Limited).seen == [(1.0, 50.0), (50.0, 10.0)]


class Method:
    """Holds functions as a class body would."""

    def retune(self, old: Gains) -> None:
        del old

    def hear(self, event: DeadlineMissed) -> None:
        del event

    def tick(self) -> None: ...


def test_on_parameters_takes_old_values_and_stands_alone(golden):
    with golden.raises(InvalidDeclaration):
        on_parameters(Method.tick)
    for other in (subscription("topic"), on_event("topic")):
        with golden.raises(InvalidDeclaration):
            other(on_parameters(Method.retune))
        with golden.raises(InvalidDeclaration):
            on_parameters(other(Method.hear))
    with golden.raises(InvalidDeclaration):
        on_parameters(timer(1)(Method.tick))


class Scaled(Parameters):
    scale: int = 1


class Scaler(Node):
    """Keeps what it computes of a parameter, and says with each message which it used."""

    parameters: Scaled

    scaled = publisher(Int64, "scaled")

    async def start(self) -> None:
        self.kept = self.parameters.scale

    @on_parameters
    def keep(self, old: Scaled) -> None:
        assert self.kept == old.scale
        self.kept = self.parameters.scale

    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        assert self.kept == self.parameters.scale, "the change was seen in part"
        self.scaled.publish(Int64(data=number.data * self.kept))


class Numbers(Node):
    numbers = publisher(Int64, "numbers")

    @timer(0.01)
    def tick(self) -> None:
        self.numbers.publish(Int64(data=1))
        self.numbers.publish(Int64(data=1))


class Tuner(Node):
    async def start(self) -> None:
        self.scale = 1

    @timer(0.01)
    async def tune(self) -> None:
        self.scale += 1
        await asyncio.sleep(0)
        self.graph.set_parameters(Scaler, scale=self.scale)


@explore(schedules=100)
async def test_no_message_sees_half_a_change():
    tuner = Tuner()
    lab = harness(Scaler, Numbers, tuner)
    tuner.graph = lab.graph
    async with lab:
        await lab.advance(0.2)
        scales = [each.data for each in lab.received("scaled")]
        assert scales == sorted(scales)
        assert len(scales) == 40
        assert lab.ledger.dropped == 0


@virtual_time
async def test_handler_stopped_while_it_awaits_is_no_failure():
    async with harness(Slow) as lab:
        lab.set_parameters(Slow, gain=2)
        await lab.advance(0.1)
        assert runtime_of(lab.node(Slow)).statistics().tasks == 1
    assert lab.graph.failures == []


@virtual_time
async def test_handler_of_an_event_names_its_node():
    async with harness(Warned) as lab:
        (handler,) = runtime_of(lab.node(Warned)).endpoints.listeners
        assert (handler.node, handler.topic) == ("/warned", "/numbers")


class Warned(Node):
    numbers = subscription(Int64, "numbers", qos=QoS(deadline=1))

    @on_event("numbers")
    def on_missed(self, _event: DeadlineMissed) -> None: ...
