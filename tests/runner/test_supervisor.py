"""One node's life: what it may raise in each of its methods, what it may still do there, and how it ends."""

import asyncio
from contextlib import nullcontext, suppress

import anyio
import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow import Graph, Message, Node, NodeFailed, publisher, subscription, timer
from busflow.clock import SimClock
from busflow.errors import ExitCode, NotRunning
from busflow.runner.supervisor import TRANSITIONS, NodeState
from busflow.testing import virtual_time


class Number(Message, package="test"):
    data: int = 0


def graph_of(*what):
    return Graph(what, clock=SimClock())


def states(graph):
    return {node.name: node.state for node in graph.report().nodes}


async def foreign_cancellation():
    """Await something that somebody cancelled, though nobody cancelled us."""
    task = asyncio.create_task(asyncio.sleep(60))
    task.cancel()
    await task


def raising(error):
    async def fail():
        raise error

    return fail


WAYS = {
    "ValueError": raising(ValueError("no")),
    "SystemExit": raising(SystemExit(3)),
    "KeyboardInterrupt": raising(KeyboardInterrupt()),
    "CancelledError": foreign_cancellation,
    "ExceptionGroup": raising(BaseExceptionGroup("both", [ValueError(), SystemExit()])),
}


class Failing(Node):
    """A node that fails in one of its methods, in one of the ways."""

    numbers = publisher(Number, "numbers")

    def fail_in(self, method, way):
        self.method, self.fail, self.seen = method, WAYS[way], []
        return self

    async def enter(self, method):
        self.seen.append(method)
        if self.method == method:
            await self.fail()

    async def start(self):
        self.spawn(self.work())
        await self.enter("start")

    async def work(self):
        await asyncio.sleep(1)
        await self.enter("task")

    async def run(self):
        await asyncio.sleep(1)
        await self.enter("run")
        await asyncio.Event().wait()

    @timer(1)
    async def tick(self):
        self.numbers.publish(Number())
        await self.enter("timer")

    @subscription("numbers")
    async def on_number(self, _number: Number):
        await self.enter("handler")

    async def stop(self):
        await self.enter("stop")


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("method", ["start", "run", "stop", "task", "timer", "handler"])
@virtual_time
async def test_any_exception_of_a_node_is_its_failure(method, way):
    failing, bystander = Failing().fail_in(method, way), Failing(name="bystander").fail_in(None, way)
    graph = graph_of(failing, bystander)
    with pytest.raises(NodeFailed) as caught:
        async with graph:
            await asyncio.sleep(1.5)
    [failure] = graph.failures
    assert failure.node == "/failing"
    assert caught.value.__cause__ is failure.error
    assert type(failure.error).__name__ in (way, "BaseExceptionGroup")
    assert (failing.seen[-1], bystander.seen[-1]) == ("stop", "stop")
    assert states(graph) == {"/failing": "failed", "/bystander": "stopped"}


@virtual_time
async def test_a_failure_ends_also_nodes_that_still_start():
    class Patient(Node):
        stopped = False

        async def start(self):
            await asyncio.sleep(5)

        async def stop(self):
            self.stopped = True

    patient = Patient()
    with pytest.raises(NodeFailed, match=r"Failing\.start"):
        await graph_of(patient, Failing().fail_in("start", "ValueError")).start()
    assert patient.stopped
    assert asyncio.get_running_loop().time() == 0


@virtual_time
async def test_stop_ends_a_waiting_start_without_failure():
    class Patient(Node):
        opened = closed = ran = False

        async def start(self):
            self.opened = True
            await asyncio.Event().wait()

        async def run(self):
            self.ran = True

        async def stop(self):
            self.closed = True

    patient = Patient()
    graph = graph_of(patient)
    starting = asyncio.create_task(graph.start())
    await asyncio.sleep(1)
    assert states(graph) == {"/patient": "starting"}
    await graph.stop()
    await starting
    await graph.wait()
    assert (patient.opened, patient.ran, patient.closed) == (True, False, True)
    assert states(graph) == {"/patient": "stopped"}


@virtual_time
async def test_a_node_goes_through_its_states_in_order():
    seen = []

    class Watched(Node):
        async def start(self):
            seen.append(graph.supervisors[0].state)

        async def run(self):
            seen.append(graph.supervisors[0].state)

        async def stop(self):
            seen.append(graph.supervisors[0].state)

    graph = graph_of(Watched)
    async with graph:
        await asyncio.sleep(1)
    assert seen == [NodeState.STARTING, NodeState.RUNNING, NodeState.STOPPING]
    assert repr(graph.supervisors[0]) == "<Supervisor /watched stopped>"


def test_each_state_leads_to_the_end_and_only_failed_is_final():
    reached, ways = set(), [NodeState.BUILT]
    while ways:
        state = ways.pop()
        reached.add(state)
        ways += set(TRANSITIONS[state]) - reached
    assert reached == set(NodeState) == set(TRANSITIONS)
    assert [state for state, following in TRANSITIONS.items() if not following] == [NodeState.FAILED]


@virtual_time
async def test_change_of_state_outside_the_table_is_refused(golden):
    async with graph_of(Failing().fail_in(None, "ValueError")) as graph:
        with golden.raises(RuntimeError):
            graph.supervisors[0].renew()
        assert states(graph) == {"/failing": "running"}


@virtual_time
async def test_start_and_stop_may_use_declared_endpoints():
    received = []

    class Talker(Node):
        numbers = publisher(Number, "numbers")

        async def start(self):
            await self.numbers.send(Number(data=1))

        async def stop(self):
            self.numbers.publish(Number(data=2))

    class Listener(Node):
        @subscription("numbers")
        def on_number(self, number: Number):
            received.append(number.data)

        async def stop(self):
            await asyncio.sleep(0.1)

    async with graph_of(Listener, Talker):
        await asyncio.sleep(1)
    assert received == [1, 2]


@virtual_time
async def test_running_work_is_cancelled_before_stop():
    order = []

    class Busy(Node):
        async def start(self):
            self.spawn(self.work("spawned"))

        async def run(self):
            await self.work("run")

        async def work(self, what):
            try:
                await asyncio.Event().wait()
            finally:
                with anyio.CancelScope(shield=True):  # cleaning up may take its time
                    await asyncio.sleep(0.1)
                order.append(what)

        async def stop(self):
            order.append("stop")

    async with graph_of(Busy):
        await asyncio.sleep(1)
    assert sorted(order[:2]) == ["run", "spawned"]
    assert order[2] == "stop"


@virtual_time
async def test_spawn_from_stop_on_is_refused():
    refused = []

    class Late(Node):
        async def stop(self):
            with pytest.raises(NotRunning, match="its stop") as caught:
                self.spawn(asyncio.sleep(1), name="late")
            refused.append(caught)

    graph = graph_of(Late)
    async with graph:
        late = graph.node(Late)
    with pytest.raises(NotRunning):
        late.spawn(asyncio.sleep(1), name="later")
    assert len(refused) == 1


@virtual_time
async def test_a_node_that_has_ended_creates_nothing():
    async with graph_of(Failing().fail_in(None, "ValueError")) as graph:
        node = graph.node(Failing)
    for create in (
        lambda: node.create_publisher(Number, "late"),
        lambda: node.create_subscription(Number, "late"),
        lambda: node.create_timer(1, print, name="late"),
    ):
        with pytest.raises(NotRunning, match="/failing "):
            create()


@virtual_time
async def test_stop_beyond_the_grace_is_reported_as_failure():
    log, order = [], []

    class Stuck(Node):
        async def stop(self):
            await asyncio.Event().wait()

    class Quick(Node):
        async def stop(self):
            order.append(self.name)

    graph = Graph([Quick(name="a"), Stuck, Quick(name="b")], clock=SimClock(), sinks=(log.append,))
    graph.course.grace_s = 0.05
    with pytest.raises(NodeFailed, match=r"StopTimeout: /stuck .* 0\.05 s"):
        async with graph:
            pass
    assert order == ["b", "a"]
    assert [record.node for record in log] == ["/stuck"]
    assert states(graph) == {"/a": "stopped", "/stuck": "failed", "/b": "stopped"}
    assert graph.exit_code == ExitCode.FAILED


class Unending(Node):
    """A node that catches its cancellation and goes on."""

    async def run(self):
        while True:
            with suppress(asyncio.CancelledError):
                await asyncio.sleep(60)


class Shielded(Node):
    """A node that no cancellation reaches."""

    async def stop(self):
        with anyio.CancelScope(shield=True):
            await asyncio.Event().wait()


@pytest.mark.parametrize(("kind", "is_left"), [(Unending, False), (Shielded, True)])
def test_a_graph_ends_without_an_endless_node(kind, is_left):
    log = []

    async def main():
        graph = Graph([kind(name="endless")], sinks=(log.append,))
        graph.course.grace_s = 0.05
        with pytest.raises(NodeFailed, match=r"/endless .* 0\.05 s"):
            async with graph:
                pass
        assert states(graph) == {"/endless": "failed"}

    asyncio.run(asyncio.wait_for(main(), 5))
    assert [record.node for record in log] == ["/endless"] * (1 + is_left)
    assert log[-1].event.startswith("left behind") == is_left


# Any life at all.

MOMENTS = st.sampled_from([0, 0.5, 1, 1.5, 2])
DEEDS = st.tuples(
    MOMENTS, st.sampled_from(["return", "raise", "exit", "cancelled", "wait", "publish", "spawn", "swallow"])
)
LATER = DEEDS.filter(lambda deed: deed[0] > 0)  # a handler that publishes to itself at once would let no time pass
LIVES = st.fixed_dictionaries({"start": DEEDS, "run": DEEDS, "tick": DEEDS, "on_number": LATER, "stop": DEEDS})
LEAVING = st.sampled_from(["body ends", "body raises", "asked", "cancelled", "timeout of asyncio", "timeout of anyio"])


class Scripted(Node):
    """A node that does in each of its methods what a script says."""

    numbers = publisher(Number, "numbers")

    def scripted(self, script):
        self.script, self.begun, self.closed = script, False, 0
        return self

    async def do(self, method):
        after_s, deed = self.script[method]
        await asyncio.sleep(after_s)
        match deed:
            case "raise":
                raise ValueError(method)
            case "exit":
                raise SystemExit(method)
            case "cancelled":
                await foreign_cancellation()
            case "wait":
                await asyncio.sleep(1000)
            case "publish":
                self.numbers.publish(Number())
            case "spawn":
                self.spawn(self.do("tick") if method != "tick" else asyncio.sleep(1), name="more")
            case "swallow":
                with suppress(asyncio.CancelledError):
                    await asyncio.sleep(1000)

    async def start(self):
        self.begun = True
        await self.do("start")

    async def run(self):
        await self.do("run")

    @timer(0.7)
    async def tick(self):
        await self.do("tick")

    @subscription("numbers")
    async def on_number(self, _number: Number):
        await self.do("on_number")

    async def stop(self):
        self.closed += 1
        await self.do("stop")


async def enter_and_leave(graph, leaving):
    """Enter the block of a graph, and leave it one way or another."""
    limits = {"timeout of anyio": anyio.fail_after}
    with limits.get(leaving, lambda _seconds: nullcontext())(1.2):
        async with asyncio.timeout(1.2 if leaving == "timeout of asyncio" else None), graph:
            await asyncio.sleep(2)
            if leaving == "body raises":
                raise KeyError("mine")
            if leaving == "asked":
                graph.ask_to_stop()
                await graph.wait()


@given(scripts=st.lists(LIVES, min_size=1, max_size=3), leaving=LEAVING, seed=st.one_of(st.none(), st.integers(0, 9)))
def test_each_node_stops_once_whatever_happens(scripts, leaving, seed):
    @virtual_time(seed=seed)
    async def main():
        nodes = [Scripted(name=f"n{index}").scripted(script) for index, script in enumerate(scripts)]
        graph = graph_of(*nodes)
        graph.course.grace_s = 0.01
        block = asyncio.create_task(enter_and_leave(graph, leaving))
        if leaving == "cancelled":
            asyncio.get_running_loop().call_later(2.5, block.cancel)
        await asyncio.wait([block])
        assert [node.closed for node in nodes] == [1] * len(nodes)
        assert set(states(graph).values()) <= {"stopped", "failed"}
        for line in graph.bus.ledger():
            assert line.published == line.delivered + line.dropped + line.queued
        names = [task.get_name() for task in asyncio.all_tasks()]
        assert [name for name in names if name.startswith(("/", "busflow"))] == []
        error = None if block.cancelled() else block.exception()
        assert error is None or isinstance(error, NodeFailed | KeyError | TimeoutError)
        if leaving in ("body ends", "asked"):
            assert isinstance(error, NodeFailed) == bool(graph.failures)

    main()
