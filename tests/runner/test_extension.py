"""What takes part in a run beside its nodes begins in order, ends in the reverse order, and always ends."""

import asyncio
from contextlib import asynccontextmanager
from dataclasses import dataclass

import pytest

from busflow import Graph, Node, NodeFailed, supervised
from busflow.bus.bus import BusObserver
from busflow.clock import SimClock
from busflow.errors import ExitCode, NotRunning
from busflow.launchfile.model.supervision import Restart, RestartPolicy
from busflow.msgs.std_msgs import Int64
from busflow.runner.extension import Extension
from busflow.testing import virtual_time


class Sensor(Node):
    """Notes its own life beside that of the extensions."""

    notes: list[str]

    def declare(self) -> None:
        self.create_publisher(Int64, "numbers")

    async def start(self) -> None:
        self.notes.append("node starts")

    async def stop(self) -> None:
        self.notes.append("node stops")


class Brief(Node):
    """Has nothing to do."""

    async def run(self) -> None:
        pass


class Failing(Node):
    """Fails in each of its lives."""

    async def run(self) -> None:
        raise ValueError("the cable is loose")


@dataclass
class Row:
    """A row of a section of the report."""

    name: str


class Part(Extension):
    """Notes all that it is called for, and raises where it is told to."""

    def __init__(self, name: str, notes: list[str], fails_in: str = "") -> None:
        self.name, self.notes, self.fails_in = name, notes, fails_in

    def note(self, what: str) -> None:
        self.notes.append(f"{self.name} {what}")
        if what == self.fails_in:
            raise OSError(f"{self.name} cannot {what}")

    def begin(self) -> None:
        self.note("begin")

    @asynccontextmanager
    async def surround(self):
        self.note("enter")
        yield
        self.note("leave")

    def nodes_started(self) -> None:
        self.note("nodes_started")

    def node_rebuilt(self, supervisor) -> None:
        self.note(f"rebuilt {supervisor.name} #{supervisor.restarts}")

    def end(self) -> None:
        self.note("end")

    def sections(self):
        return {self.name: (Row(self.name),)}


def graph_of(*nodes, notes=(), **fails_in):
    """A graph with the parts one, two and three."""
    graph = Graph(nodes, clock=SimClock())
    for name in ("one", "two", "three"):
        graph.attach(Part(name, notes, fails_in.get(name, "")))
    return graph


def sensor(notes):
    node = Sensor()
    node.notes = notes
    return node


@virtual_time
async def test_extensions_end_in_reverse_order_of_their_begin():
    notes: list[str] = []
    async with graph_of(sensor(notes), notes=notes):
        pass
    assert notes == [
        *("one begin", "two begin", "three begin"),
        *("one enter", "two enter", "three enter"),
        "node starts",
        *("one nodes_started", "two nodes_started", "three nodes_started"),
        "node stops",
        *("three leave", "two leave", "one leave"),
        *("three end", "two end", "one end"),
    ]


@virtual_time
async def test_failing_begin_ends_the_extensions_already_begun(golden):
    notes: list[str] = []
    graph = graph_of(sensor(notes), notes=notes, two="begin")
    with golden.raises(OSError):
        await graph.start()
    assert notes == ["one begin", "two begin", "one end"]
    assert graph.bus.topics == {}


@virtual_time
async def test_extensions_end_if_a_node_cannot_connect(golden):
    notes: list[str] = []
    graph = graph_of(sensor(notes), notes=notes)

    class Refusal(BusObserver):
        def parameters_added(self, _store: object) -> None:
            raise OSError("there is no room")

    graph.bus.observe(Refusal())
    with golden.raises(OSError):
        await graph.start()
    assert notes[3:] == ["three end", "two end", "one end"]


@pytest.mark.parametrize("where", ["wait", "stop"])
@virtual_time
async def test_failing_end_is_raised_after_all_ends(where, golden):
    notes: list[str] = []
    graph = graph_of(Brief, notes=notes, two="end")
    await graph.start()
    with golden.raises(OSError):
        await getattr(graph, where)()
    assert notes[-3:] == ["three end", "two end", "one end"]


@virtual_time
async def test_failing_surround_keeps_nodes_from_starting(golden):
    notes: list[str] = []
    graph = graph_of(sensor(notes), notes=notes, two="enter")
    with golden.raises(OSError):
        await graph.start()
    assert notes[3:] == ["one enter", "two enter", "three end", "two end", "one end"]


@virtual_time
async def test_every_extension_is_notified_of_a_rebuilt_node():
    notes: list[str] = []
    graph = graph_of(supervised(Failing, restart=RestartPolicy(Restart.ON_FAILURE, most=1)), notes=notes)
    with pytest.raises(NodeFailed):
        async with graph:
            await graph.wait()
    assert [each for each in notes if "rebuilt" in each] == [
        f"{part} rebuilt /failing #1" for part in ("one", "two", "three")
    ]


class Waiting(Extension):
    """Keeps the run going until it is ready."""

    ready = False

    def is_finished(self) -> bool:
        return self.ready


@virtual_time
async def test_run_goes_on_until_every_extension_is_finished():
    graph, waiting = Graph([Brief], clock=SimClock()), Waiting()
    graph.attach(waiting)
    await graph.start()
    await asyncio.sleep(1)
    assert graph.course.has_finished
    assert not graph.course.ending.is_set()
    waiting.ready = True
    graph.course.end_if_finished()
    await graph.wait()
    assert graph.exit_code is ExitCode.OK


@virtual_time
async def test_each_extension_adds_a_section_to_the_report():
    form = graph_of(Brief).report().as_json()
    assert [form[name] for name in ("one", "two", "three")] == [[{"name": name}] for name in ("one", "two", "three")]


@virtual_time
async def test_end_times_of_extensions_add_up():
    graph = graph_of(Brief)
    graph.course.extensions[0].end_s, graph.course.extensions[2].end_s = 1.5, 0.5
    assert graph.course.end_s == 2.0


@virtual_time
async def test_attach_after_start_is_refused(golden):
    async with Graph([sensor([])], clock=SimClock()) as graph:
        with golden.raises(NotRunning):
            graph.attach(Extension())
