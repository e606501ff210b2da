"""Watching: an edited launch file is applied to the graph that runs from it, or refused while the run goes on."""

from pathlib import Path

import pytest

from busflow.launchfile.load.load import examine, load
from busflow.msgs.std_msgs import Float64
from busflow.runner.live_edit import POLL_S, FileWatch
from busflow.testing import harness, virtual_time

PLUGINS = {
    "talker": """
from pydantic import Field

from busflow import Node, Parameters, ReadOnly, publisher, timer
from busflow.msgs.std_msgs import Float64

class P(Parameters):
    rate_hz: float = Field(default=10.0, ge=0)
    value: float = 0.0
    frame: ReadOnly[str] = "a"

class Talker(Node):
    parameters: P
    out = publisher(Float64, "numbers")

    async def start(self):
        self.log.info("starts", value=self.parameters.value)

    async def stop(self):
        self.log.info("stops")

    @timer(hz="rate_hz")
    def tick(self):
        self.out.publish(Float64(data=self.parameters.value))
""",
    "listener": """
from busflow import Node, Parameters, subscription
from busflow.msgs.std_msgs import Float64

class Listener(Node):
    parameters: Parameters

    @subscription("numbers")
    def on_number(self, number: Float64):
        pass
""",
}
LAB = """plugins: [.]
args:
  value: {type: float, default: 1.0}
nodes:
  talker:
    plugin: talker
    parameters:
      value: ${args.value}
  listener:
    plugin: listener
"""


class Lab:
    """A launch file that is watched, and the harness that runs it."""

    def __init__(self, file: Path, text: str) -> None:
        self.file = file
        self.write(text)
        description = load(file, environment={})
        self.lab = harness(description)
        self.lab.graph.attach(FileWatch(self.lab.graph, description, lambda: examine(file, environment={})))

    def write(self, text: str) -> None:
        """Write as editors do: a new file, in the place of the old one."""
        beside = self.file.with_suffix(".new")
        beside.write_text(text)
        beside.replace(self.file)

    async def edit(self, text: str) -> list[str]:
        """Write, let the graph follow, and return what was logged on the way."""
        known = len(self.lab.log)
        self.write(text)
        await self.lab.advance(4 * POLL_S)
        return [f"{line.node}: {line.event}" for line in self.lab.log[known:]]

    def changes(self) -> dict[str, str]:
        """What the last edit has changed."""
        lines = [line.values for line in self.lab.log if line.event == "follows the edited launch file"]
        return dict(lines[-1])

    def last(self) -> float:
        return self.lab.received("numbers", Float64)[-1].data

    def states(self) -> dict[str, str]:
        return {node.name: node.state for node in self.lab.graph.report().nodes}


@pytest.fixture
def watched(tmp_path):
    for name, text in PLUGINS.items():
        (tmp_path / f"{name}.py").write_text(text)
    return lambda text=LAB: Lab(tmp_path / "lab.yaml", text)


def ledger_is_intact(lab) -> bool:
    lines = list(lab.ledger)
    return bool(lines) and all(line.published == line.delivered + line.dropped + line.queued for line in lines)


@virtual_time
async def test_changed_parameter_is_set_on_running_node(watched, golden):
    file = watched()
    async with file.lab as lab:
        await lab.advance(1)
        node = lab.node("talker")
        golden((await file.edit(LAB.replace("${args.value}", "2.5")))[-1])
        assert (file.last(), lab.node("talker") is node) == (2.5, True)
        assert file.changes() == {"set": "/talker value"}
        await file.edit(LAB.replace("default: 1.0", "default: 3.0"))
        assert file.last() == 3.0
        await file.edit(LAB.replace("    parameters:\n      value: ${args.value}\n", ""))
        assert (file.last(), lab.node("talker") is node) == (0.0, True)


@virtual_time
async def test_runtime_parameter_stays_unless_edited(watched):
    file = watched()
    async with file.lab as lab:
        lab.set_parameters("talker", rate_hz=50.0)
        await file.edit(LAB.replace("default: 1.0", "default: 3.0"))
        assert (lab.node("talker").parameters.rate_hz, file.last()) == (50.0, 3.0)


@virtual_time
async def test_invalid_edit_is_refused_and_run_continues(watched, golden):
    file = watched()
    async with file.lab as lab:
        await lab.advance(1)
        for wrong, problem in (
            (LAB.replace("value: ${args.value}", "valeu: 1"), "/talker: unknown parameter valeu"),
            (LAB.replace("    plugin: listener\n", "    plugn: listener\n"), "unknown key nodes.listener.plugn"),
            (LAB + "  - x\n", "this does not line up with what is around it"),
            (
                LAB.replace("${args.value}", "2.5") + "    remap: {nubmers: x}\n",
                "the remap of nubmers matches no topic",
            ),
        ):
            lines = await file.edit(wrong)
            assert any(line.startswith(f"busflow: {problem}") for line in lines)
            golden(lines[-1])
        at = [line.values["at"] for line in lab.log if "valeu" in line.event]
        assert at == [f"{file.file}:8:7"]
        assert (file.last(), set(file.states().values())) == (1.0, {"running"})
        assert "follows" in (await file.edit(LAB.replace("${args.value}", "4")))[-1]
        assert file.last() == 4.0


@virtual_time
async def test_added_and_removed_nodes_stay_in_the_ledger(watched):
    file = watched()
    async with file.lab as lab:
        await lab.advance(1)
        talker = lab.node("talker")
        await file.edit(LAB + "  second:\n    plugin: talker\n    namespace: x\n    remap: {numbers: /numbers}\n")
        assert file.states() == {"/talker": "running", "/listener": "running", "/x/second": "running"}
        assert file.changes() == {"started": "/x/second"}
        before = len(lab.received("numbers"))
        await lab.advance(1)
        assert len(lab.received("numbers")) == before + 20
        lines = await file.edit(LAB.replace("  listener:\n    plugin: listener\n", ""))
        assert "/x/second: stops" in lines
        assert (file.states(), lab.node("talker") is talker) == ({"/talker": "running"}, True)
        assert file.changes() == {"stopped": "/listener, /x/second"}
        await lab.advance(1)
        assert ledger_is_intact(lab)
    assert lab.graph.report().exit_code == 0


@virtual_time
async def test_a_newcomer_waits_for_what_runs_already(watched):
    file = watched(LAB.replace("${args.value}", "1.0\n      rate_hz: 0"))
    quiet = file.file.read_text()
    async with file.lab as lab:
        newcomer = "  third:\n    plugin: listener\n    depends_on: {talker: first_message}\n"
        await file.edit(quiet + newcomer)
        assert file.states()["/third"] == "waiting"
        lab.set_parameters("talker", rate_hz=10.0)
        await lab.advance(1)
        assert file.states()["/third"] == "running"
        for condition in ("first_message", "started", "ready"):
            await file.edit(
                quiet + newcomer + newcomer.replace("third", condition).replace("first_message}", condition + "}")
            )
            assert file.states()[f"/{condition}"] == "running"


@pytest.mark.parametrize(
    "edited",
    [
        LAB + "    subscriptions:\n      numbers: {depth: 2}\ntopics:\n  numbers: {qos: {depth: 3}}\n",
        LAB.replace("      value:", "      frame: b\n      value:"),
        LAB.replace("    parameters:", "    remap: {numbers: others}\n    parameters:"),
        LAB.replace("    parameters:", "    restart: on-failure\n    parameters:"),
    ],
    ids=["qos", "read-only parameter", "remap", "restart"],
)
@virtual_time
async def test_change_that_cannot_be_set_restarts_node(watched, edited):
    file = watched()
    async with file.lab as lab:
        await lab.advance(1)
        nodes = {name: lab.node(name) for name in ("talker", "listener")}
        lines = await file.edit(edited)
        anew = file.changes()["restarted"].split(", ")
        assert {f"/{name}" for name, node in nodes.items() if lab.node(name) is not node} == set(anew)
        assert ("/talker: starts" in lines) == ("/talker" in anew)
        assert set(file.states().values()) == {"running"}
        await lab.advance(1)
        assert ledger_is_intact(lab)


@virtual_time
async def test_change_for_the_next_run_is_logged(watched, golden):
    file = watched()
    async with file.lab as lab:
        await file.edit(LAB + "seed: 5\nenv: {A: b}\npackages: {lab: .}\n")
        golden("\n".join(f"{line.event} {line.values}" for line in lab.log[-2:]))


@virtual_time
async def test_rewritten_file_or_comment_changes_nothing(watched):
    file = watched()
    async with file.lab as lab:
        await lab.advance(1)
        node = lab.node("talker")
        assert await file.edit(LAB) == []
        (line,) = await file.edit("# a comment\n" + LAB)
        assert line.startswith("busflow: ")
        assert (file.changes(), lab.node("talker") is node) == ({"changed": "nothing that runs"}, True)


@virtual_time
async def test_missing_file_is_awaited_and_includes_are_watched(watched):
    file = watched()
    async with file.lab as lab:
        file.file.unlink()
        await lab.advance(2)
        assert "cannot read" in " ".join(line.event for line in lab.log)
        (file.file.parent / "inner.yaml").write_text(LAB)
        await file.edit("include: inner.yaml\n")
        assert set(file.states().values()) == {"running"}
        (file.file.parent / "inner.yaml").write_text(LAB.replace("default: 1.0", "default: 9.0"))
        await lab.advance(2)
        assert file.last() == 9.0
