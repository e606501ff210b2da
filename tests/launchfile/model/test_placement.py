"""Placement of nodes: as the launch file says, all in one process, or each in its own."""

import pytest

from busflow.launchfile.load.load import examine, load
from busflow.launchfile.model.placement import ProcessLayout, placed

FILE = """
processes:
  eyes: {nice: 5, env: {THREADS: 1}, restart: on-failure}
  idle:
nodes:
  left/camera: {plugin: p, process: eyes}
  tracker: {plugin: p, process: eyes}
  planner: {plugin: p}
  motor: {plugin: p, process: main}
"""


@pytest.fixture
def described(folder):
    folder.write(FILE)
    return load("lab1.yaml")


@pytest.mark.parametrize(
    ("layout", "expected"),
    [
        (ProcessLayout.FILE, {"main": ("/planner", "/motor"), "eyes": ("/left/camera", "/tracker")}),
        (ProcessLayout.ONE, {"main": ("/left/camera", "/tracker", "/planner", "/motor")}),
        (
            ProcessLayout.AUTO,
            {"main": (), "eyes": ("/left/camera", "/tracker"), "planner": ("/planner",), "motor": ("/motor",)},
        ),
    ],
)
def test_every_node_is_in_one_process(described, layout, expected):
    placement = placed(described, layout)
    assert placement.nodes == expected
    assert set(placement.others) == set(expected) - {"main"}
    assert set(placement.others) <= set(placement.specs)
    for process, nodes in expected.items():
        assert [placement.process_of(node) for node in nodes] == [process] * len(nodes)


def test_node_named_like_a_process_gets_another(folder):
    folder.write("processes: {a: {}}\nnodes: {a: {plugin: p}, main: {plugin: p}, x: {plugin: p, process: a}}\n")
    nodes = placed(load("lab1.yaml"), ProcessLayout.AUTO).nodes
    assert nodes == {"main": (), "a-1": ("/a",), "main-1": ("/main",), "a": ("/x",)}


def test_settings_of_a_process_are_kept(described):
    eyes, _ = described.processes
    assert (eyes.nice, eyes.env, eyes.restart.when) == (5, {"THREADS": "1"}, "on-failure")


@pytest.mark.parametrize(
    ("text", "place", "expected"),
    [
        ("processes: {eyes: {}}\nnodes: {a: {plugin: p, process: eye}}", "2:33", "there is no process eye"),
        ("processes: {main: {}}\nnodes: {a: {plugin: p}}", "1:13", "main is the process that busflow run itself is"),
        ("processes: {a b: {}}\nnodes: {a: {plugin: p}}", "1:13", "process name 'a b'"),
        ("processes: {a: {nice: 20}}\nnodes: {a: {plugin: p}}", "1:23", "nice must be at most 19"),
        ("processes: {a: {cpus: 1}}\nnodes: {a: {plugin: p}}", "1:17", "unknown key processes.a.cpus"),
    ],
)
def test_placement_mistake_is_reported_at_its_place(folder, text, place, expected):
    folder.write(text)
    _, problems = examine("lab1.yaml")
    assert [str(problem.place) for problem in problems] == [f"lab1.yaml:{place}"]
    assert expected in problems[0].message
