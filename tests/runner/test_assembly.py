"""A run of each kind has its features: they begin in one order, and end in the reverse order."""

import asyncio
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from busflow import Graph
from busflow.clock import SimClock
from busflow.errors import ExitCode
from busflow.launchfile.load.load import load
from busflow.recording.bag.bag import Bag
from busflow.runner.assembly import Feature, Given, Kind, Role, Run
from busflow.runner.extension import Extension
from busflow.runner.loops.virtual import VirtualLoop
from busflow.runner.loops.virtual_test import run_virtual
from busflow.wire.zenoh.run_directory import runs
from tests.processes.conftest import NODES

LAB = f"""
name: assembled
plugins: [{NODES}]
nodes:
  source: {{plugin: source, parameters: {{rate_hz: 100}}}}
programs:
  tool: {{command: [sleep, "600"]}}
record: {{to: RECORDING}}
"""
SNAPSHOTS = "record: {to: RECORDING, snapshot: 60s}"
WORKER = "  sink: {plugin: sink, process: left, parameters: {enough: 1}}\nprocesses: {left: }\n"

ALONE = ["Inspection", "Trace", "Programs", "Recorder"]
MAIN = ["ProcessGroup", "Trace", "Programs", "JointRecording", "Recorder"]


class Witness(Extension):
    """Looks for the run when it is first asked for its report, which a recording does at its end."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.was_found: list[bool] = []

    def sections(self) -> Mapping[str, object]:
        self.was_found.append(self.name in [each.name for each in runs()])
        return {}


@contextmanager
def noted(graph: Graph) -> Iterator[list[str]]:
    """Note each begin and end of the features that a graph has."""
    notes: list[str] = []

    def note(what: str, act: Callable[[], None]) -> Callable[[], None]:
        def noting() -> None:
            notes.append(what)
            act()

        return noting

    with pytest.MonkeyPatch.context() as patch:
        for each in tuple(graph.course.extensions):
            name = type(each).__name__
            patch.setattr(each, "begin", note(f"{name} begins", each.begin))
            patch.setattr(each, "end", note(f"{name} ends", each.end))
        yield notes


def in_order(names: list[str]) -> list[str]:
    return [*(f"{name} begins" for name in names), *(f"{name} ends" for name in reversed(names))]


@pytest.fixture
def stated(tmp_path: Path) -> Callable[..., Any]:
    """The description of a launch file that has every feature."""

    def stated(*changes: tuple[str, str], more: str = "") -> Any:
        text = LAB
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        file = tmp_path / "run.yaml"
        file.write_text(text.replace("programs:", f"{more}programs:").replace("RECORDING", str(tmp_path / "run.mcap")))
        return load(file)

    return stated


@pytest.mark.parametrize(
    ("more", "names", "file"), [("", ALONE, "run.mcap"), (WORKER, MAIN, "run")], ids=["alone", "main"]
)
def test_whole_program_has_every_feature_in_order(stated: Any, tmp_path: Path, more: str, names: list[str], file: str):
    lines: list[str] = []
    given = Given(inspect=True, trace=lines.append)
    with Run([stated(more=more)], Kind.RUN, given) as run:
        graph = run.build()
        witness = Witness("assembled")
        graph.attach(witness)
        with noted(graph) as notes:
            assert run.go(print, for_s=0.2) is ExitCode.OK
    assert notes == in_order([*names, "Witness"])
    assert witness.was_found[0], "the recording ended after the mirror"
    assert any("publish /numbers" in line for line in lines)
    with Bag(tmp_path / file) as bag:
        assert not bag.incomplete


def test_program_around_a_graph_has_them_in_the_same_order(stated: Any):
    given = Given(inspect=True, trace=lambda _line: None)
    graph = Run([stated()], Kind.LAUNCH, given).build()

    async def main() -> None:
        async with graph:
            pass

    with noted(graph) as notes:
        asyncio.run(main())
    assert notes == in_order(ALONE)


@pytest.mark.parametrize(
    ("kind", "changes", "record", "names"),
    [
        (Kind.TEST, (), None, []),
        (Kind.TEST, [("record: {to: RECORDING}", SNAPSHOTS)], None, ["SnapshotRecorder"]),
        (Kind.TEST, [("record: {to: RECORDING}", SNAPSHOTS)], False, []),
        (Kind.HARNESS, (), None, []),
        (Kind.HARNESS, (), "asked.mcap", ["Recorder"]),
        (Kind.REPLAY, (), None, []),
        (Kind.REPLAY, (), "asked.mcap", ["Recorder"]),
    ],
)
def test_tests_record_by_their_kind_and_start_no_program(
    stated: Any, tmp_path: Path, kind: Kind, changes: Any, record: Any, names: list[str]
):
    file = tmp_path / record if record else record
    loop = VirtualLoop(thread_s=60.0)
    clock = None if kind is Kind.TEST else SimClock(loop=loop)
    given = Given(inspect=True, trace=lambda _line: None, record=file, clock=clock, simulated=True)
    with Run([stated(*changes)], kind, given) as run:
        graph = run.build()

        async def main() -> None:
            async with graph:
                await graph.clock.sleep(1.0)

        with noted(graph) as notes:
            run_virtual(main(), name="test", loop=run.virtual_loop if run.owns_loop else loop)
    loop.close()
    assert notes == in_order(["Trace", *names])


def test_plan_has_no_feature(stated: Any):
    run = Run([stated(more=WORKER)], Kind.PLAN, Given(inspect=True, record=True))
    assert [each.runtime.full_name for each in run.plan().nodes] == ["/source", "/sink"]
    assert run.graph.course.extensions == []


def test_worker_attaches_its_own_features_in_the_same_order(stated: Any):
    notes: list[Feature] = []
    own = {each: lambda _run, each=each: notes.append(each) for each in (Feature.RECORDER, Feature.LINK)}
    graph = Run([stated()], Kind.RUN, Given(inspect=True), role=Role.WORKER, own=own).build()
    assert notes == [Feature.LINK, Feature.RECORDER]
    assert graph.course.extensions == [], "programs are the main process's"
