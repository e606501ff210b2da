"""What nodes give to the event loop themselves: none of it fails in silence."""

import asyncio
import gc
import warnings

import pytest

import busflow
from busflow import Node, NodeFailed, client, publisher, subscription, supervised, timer
from busflow.errors import ExitCode, Stray
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import Trigger
from busflow.testing import harness, virtual_time


class Worker(Node):
    """Makes a task by itself, which fails after 0.2 s."""

    async def work(self) -> None:
        await asyncio.sleep(0.2)
        raise ValueError("cable loose")


class Forgetful(Worker):
    """Makes a task that nobody holds."""

    async def start(self) -> None:
        asyncio.create_task(self.work())  # noqa: RUF006  # that is the mistake


class Holding(Worker):
    """Makes a task, holds it, and does not look at it."""

    async def start(self) -> None:
        self.task = asyncio.create_task(self.work())


class Awaiting(Holding):
    """Looks at its task a second later."""

    async def run(self) -> None:
        await asyncio.sleep(1)
        try:
            await self.task
        except ValueError as error:
            self.log.info("mended", error=str(error))


class Prompt(Holding):
    """Waits for its task from the beginning, and sees that it failed a moment later."""

    async def run(self) -> None:
        done, _ = await asyncio.wait([self.task])
        assert isinstance(next(iter(done)).exception(), ValueError)


class Closing(Holding):
    """Looks at its task when it stops."""

    async def stop(self) -> None:
        await asyncio.gather(self.task, return_exceptions=True)


async def elsewhere() -> None:
    await asyncio.sleep(0.2)
    raise ValueError("cable loose")


class Driver:
    """No node, and makes tasks within tasks."""

    async def open(self) -> None:
        self.task = asyncio.create_task(elsewhere())


class Nested(Node):
    """Has something of its own make its tasks."""

    async def start(self) -> None:
        self.driver = Driver()
        self.task = asyncio.create_task(self.driver.open())


class Calling(Node):
    """Has the event loop call it."""

    async def start(self) -> None:
        asyncio.get_running_loop().call_later(0.2, self.due)

    def due(self) -> None:
        raise ValueError("cable loose")


async def seconds(what: object, *, of: float) -> list[str]:
    """What the log says when a node has run for so long."""
    async with harness(what) as lab:  # type: ignore[arg-type]  # a node
        await lab.advance(of)
        return [f"{line.level}: {line.event}" for line in lab.log]


@virtual_time
async def test_unreferenced_failed_task_fails_its_node_at_once(golden):
    with golden.raises(NodeFailed):
        await seconds(Forgetful, of=0.2)


@virtual_time
async def test_referenced_failed_task_warns_then_fails_node(golden):
    async with harness(Holding, expect_failure=Holding) as lab:
        await lab.advance(0.4)
        assert [(line.level, line.values["task"]) for line in lab.log] == [("warning", "work")]
        golden(lab.log[0].event)
        assert "cable loose" in lab.log[0].values["error"]
    assert lab.graph.exit_code is ExitCode.FAILED


@virtual_time
async def test_task_failing_just_before_end_is_found():
    with pytest.raises(NodeFailed, match="cable loose"):
        await seconds(Holding, of=0.2)


@pytest.mark.parametrize("node", [Prompt, Closing])
@virtual_time
async def test_awaited_task_does_not_fail_its_node(node):
    assert await seconds(node, of=0.25) == []


@virtual_time
async def test_task_awaited_late_does_not_fail_node():
    warned, mended = await seconds(Awaiting, of=2)
    assert (warned.split(":")[0], mended) == ("warning", "info: mended")


@virtual_time
async def test_task_made_by_a_task_keeps_its_node(golden):
    with golden.raises(NodeFailed):
        await seconds(Nested, of=1)


def begin(_number: Int64) -> None:
    """A handler that is no method."""
    TASKS.append(asyncio.create_task(elsewhere()))


TASKS: list[asyncio.Task[None]] = []


class Talker(Node):
    """Publishes from a task of its own."""

    numbers = publisher(Int64, "numbers")

    async def start(self) -> None:
        self.task = asyncio.create_task(self.talk())

    async def talk(self) -> None:
        await asyncio.sleep(0.1)
        self.numbers.publish(Int64(data=1))


class Listener(Node):
    """Has a function called with each message."""

    def declare(self) -> None:
        self.create_subscription(Int64, "numbers", begin)


def test_sender_does_not_own_a_handler_s_task(golden):
    @virtual_time
    async def test() -> None:
        async with harness(Talker, Listener) as lab:
            await lab.advance(0.2)
            TASKS.clear()
            await lab.advance(1)

    with golden.raises(Stray):
        test()


class Spawning(Node):
    """Makes its task in a task that a handler spawns."""

    @subscription("numbers")
    def hear(self, _: Int64) -> None:
        self.spawn(self.drive())

    async def drive(self) -> None:
        await Driver().open()


class Handing(Node):
    """Has a handler make a task of something else."""

    @subscription("numbers")
    def hear(self, _: Int64) -> None:
        self.task = asyncio.create_task(elsewhere())


class Nesting(Node):
    """Has a handler make a task of something else, which makes another one."""

    @subscription("numbers")
    def hear(self, _: Int64) -> None:
        self.driver = Driver()
        self.task = asyncio.create_task(self.driver.open())


@pytest.mark.parametrize("node", [Spawning, Handing, Nesting])
@virtual_time
async def test_task_of_a_handler_is_its_nodes(node):
    async with harness(Talker, node, expect_failure=node) as lab:
        await lab.advance(1)
    assert {each.node for each in lab.graph.failures} == {f"/{node.__name__.lower()}"}


@virtual_time
async def test_raising_callback_fails_the_node_of_its_method(golden):
    with golden.raises(NodeFailed):
        await seconds(Calling, of=1)


@virtual_time
async def a_test_with_a_task(*, then: str) -> None:
    async with harness(Prompt) as lab:
        task = asyncio.create_task(elsewhere())
        if then == "forget it":
            del task
        await lab.advance(0.25)
    if then == "await it":
        with pytest.raises(ValueError, match="cable loose"):
            await task


def test_failed_task_of_no_node_fails_run():
    for then in ("forget it", "hold it"):
        with pytest.raises(Stray, match="task elsewhere") as lost:
            a_test_with_a_task(then=then)
        assert isinstance(lost.value.__cause__, ValueError)
    a_test_with_a_task(then="await it")


@virtual_time
async def test_failed_orphan_task_restarts_its_node():
    async with harness(supervised(Forgetful, restart="on-failure")) as lab:
        await lab.advance(0.3)
        assert [line.event for line in lab.log if line.level == "warning"] == ["restarts"]


@virtual_time
async def test_graphs_on_one_loop_fail_their_own_nodes():
    async with harness(Prompt) as healthy:
        with pytest.raises(NodeFailed):
            await seconds(Forgetful, of=1)
        assert healthy.graph.failures == []


@pytest.mark.parametrize("event_loop", ["busflow", pytest.param("uvloop", marks=pytest.mark.needs("uvloop"))])
def test_a_run_ends_with_the_failure(capsys, event_loop):
    assert busflow.run(Forgetful, inspect=False, event_loop=event_loop) is ExitCode.FAILED
    output = capsys.readouterr().err
    assert "error: node /forgetful failed" in output
    assert "Traceback" not in output


class Stubborn(Node):
    """Its task raises only when all is over."""

    async def start(self) -> None:
        self.task = asyncio.create_task(self.work())

    async def run(self) -> None:
        await asyncio.sleep(0)

    async def work(self) -> None:
        try:
            await asyncio.sleep(3600)
        finally:
            raise ValueError("cable loose")


def test_error_at_loop_close_is_reported(capsys):
    assert busflow.run(supervised(Stubborn, on_exit="shutdown"), inspect=False) is ExitCode.FAILED
    assert "cable loose" in capsys.readouterr().err


def test_foreign_loop_is_left_as_it_was():
    reported: list[str] = []

    def program_fails() -> None:
        raise ValueError("of the program")

    async def main() -> tuple[object, object]:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(handler := lambda _, context: reported.append(str(context["exception"])))
        async with busflow.launch(Prompt) as graph, busflow.launch(Node):
            loop.call_soon(program_fails)
            await graph.clock.sleep(0.01)
        return loop.get_task_factory(), loop.get_exception_handler() is handler

    assert asyncio.run(main()) == (None, True)
    assert reported == ["of the program"]


@pytest.mark.parametrize("node", [Forgetful, Holding, Calling])
def test_failure_on_a_foreign_loop_fails_its_node(node):
    async def main() -> None:
        async with busflow.launch(node) as graph, asyncio.timeout(5):
            if node is Holding:
                await asyncio.wait([graph.node(Holding).task])
            else:
                await graph.wait()

    with pytest.raises(NodeFailed, match="cable loose"):
        asyncio.run(main())


class Hasty(Node):
    """Forgets to await."""

    @timer(0.05)
    def tick(self) -> None:
        self.work()  # type: ignore[unused-coroutine]  # that is the mistake
        self.log.info("ticked")
        raise SystemExit

    async def work(self) -> None:
        await asyncio.sleep(0)


@pytest.mark.filterwarnings("default::RuntimeWarning")
def test_unawaited_coroutine_is_logged_with_node_and_line(capsys):
    gc.collect()
    busflow.run(Hasty, inspect=False)
    output = next(line for line in capsys.readouterr().err.splitlines() if "never awaited" in line)
    assert "warning  /hasty: coroutine 'Hasty.work' " in output
    assert "test_orphan_tasks.py:" in output


class Deprecating(Node):
    """Uses something that warns."""

    async def start(self) -> None:
        warnings.warn("the sensor is old", stacklevel=1)
        raise SystemExit


def test_other_warnings_are_shown_as_before():
    with pytest.warns(UserWarning, match="the sensor is old"):
        busflow.run(Deprecating, inspect=False)


class Keeping(Node):
    """Forgets to await a call, and keeps what it returns."""

    reset = client(Trigger, "reset")

    @timer(0.05)
    def tick(self) -> None:
        _kept = self.reset.call()

    @timer(0.12)
    def use(self) -> None:
        self.log.info(self.reset.call().success)  # type: ignore[attr-defined]  # that is the mistake


@pytest.mark.filterwarnings("default::RuntimeWarning")
def test_unawaited_call_names_its_timer_or_line(capsys):
    gc.collect()
    assert busflow.run(Keeping, inspect=False) == ExitCode.FAILED
    gc.collect()
    output = capsys.readouterr().err
    assert "; write await " in output
    (line,) = [line for line in output.splitlines() if "never awaited" in line]
    assert "busflow: coroutine 'Client.call' " in line
    assert "called_by=<Timer tick of /keeping" in line


class Quitting(Node):
    """Raises what Python keeps for generators."""

    async def start(self) -> None:
        raise GeneratorExit


def test_generator_exit_of_a_hook_fails_its_node():
    async def main() -> None:
        async with busflow.launch(Quitting):
            pass

    with pytest.raises(NodeFailed, match=r"Quitting\.start"):
        asyncio.run(main())
