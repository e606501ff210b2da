"""Tests of `load.py` and `build.py`: files, includes and command line become one description."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.bus.qos import TRANSIENT_LOCAL
from busflow.errors import LaunchError
from busflow.launchfile.load.load import examine, load
from busflow.launchfile.model.description import ClockMode, ClockSpec, NodeSpec
from busflow.launchfile.model.supervision import Restart
from busflow.text import printable

TALKER = "nodes:\n  talker:\n    plugin: talker\n"


def node(folder, text: str, **how: object) -> NodeSpec:
    (found,) = folder.load(text, **how).nodes
    return found


def test_a_whole_file_becomes_a_description(folder):
    folder.write("", "plugins/talker.py")
    found = folder.load("""
        name: lab1
        plugins: [plugins]
        seed: 7
        clock: {mode: sim, start: 100, rate: 2}
        shutdown: {grace: 500ms}
        qos:
          sensor: {depth: 5, reliability: best_effort, deadline: 50ms}
        topics:
          imu/data: {qos: sensor, type: sensor_msgs/msg/Imu}
          /joints: {qos: {depth: 3}}
          /map: {qos: transient_local}
        nodes:
          talker:
            plugin: talker
            namespace: left
            parameters: {rate: 10, noise: {imu: 0.1}}
            remap: {imu: /imu/data}
            publishers: {imu: sensor_data}
            subscriptions: {joints: {overflow: block, block_timeout: 2}}
            restart: on-failure
        x-note: anything
    """)
    assert (found.name, found.seed, found.shutdown_grace_s) == ("lab1", 7, 0.5)
    assert found.clock == ClockSpec(ClockMode.SIM, 100.0, 2.0)
    assert [folder.path for folder in found.folders] == [Path("plugins")]
    topics = {each.topic: each for each in found.topics}
    assert topics["/imu/data"].qos.model_dump(exclude_unset=True) == {
        "depth": 5,
        "reliability": "best_effort",
        "deadline_s": 0.05,
    }
    assert topics["/imu/data"].type == "sensor_msgs/msg/Imu"
    assert topics["/map"].qos is TRANSIENT_LOCAL
    assert topics["/joints"].qos.model_fields_set == {"depth"}
    (talker,) = found.nodes
    assert (talker.full_name, talker.plugin, talker.supervision.restart.when) == (
        "/left/talker",
        "talker",
        Restart.ON_FAILURE,
    )
    assert talker.parameters.data == {"rate": 10, "noise": {"imu": 0.1}}
    assert [(rule.match, rule.replacement) for rule in talker.remap] == [("imu", "/imu/data")]
    assert talker.publishers[0].qos.reliability == "best_effort"
    assert talker.subscriptions[0].qos.model_fields_set == {"overflow", "block_timeout_s"}
    assert talker.folders == (Path("plugins"),)


def test_run_name_defaults_to_the_file_name(folder):
    assert folder.load(TALKER).name == "lab1"


def test_keys_without_a_value_count_as_not_stated(folder):
    found = folder.load("plugins:\nargs:\nqos:\ntopics:\nseed:\n" + TALKER + "    parameters:\n    remap:\n")
    assert found.nodes[0].parameters.data == {}
    assert found.seed is None


def test_x_keys_are_allowed_at_every_level(folder):
    found = folder.load("x-a: [1]\n" + TALKER + "    x-b: {c: [1]}\nclock: {x-d: 1}\n")
    assert found.nodes[0].full_name == "/talker"


def test_command_line_overrides_file_overrides_includes(folder):
    folder.write(
        """
        args: {rate: {type: float, default: 1}}
        nodes:
          talker:
            plugin: talker
            restart: always
            parameters: {rate: "${args.rate}", name: base, noise: {imu: 1, joints: 1}}
        topics:
          /imu: {qos: {depth: 1, overflow: block}}
        seed: 1
        """,
        "base.yaml",
    )
    text = """
        include: [{file: base.yaml, args: {rate: 2}}]
        nodes:
          talker:
            parameters: {name: file, noise: {imu: 2}}
        topics:
          /imu: {qos: {depth: 2}}
        """
    found = folder.load(text, sets=["nodes.talker.parameters.noise.imu=3", "topics.imu.qos.depth=3"])
    (talker,) = found.nodes
    assert talker.parameters.data == {"rate": 2.0, "name": "file", "noise": {"imu": 3, "joints": 1}}
    assert (talker.plugin, talker.supervision.restart.when, found.seed) == ("talker", Restart.ALWAYS, 1)
    assert found.topics[0].qos.model_dump(exclude_unset=True) == {"depth": 3, "overflow": "block"}
    origins = {path: str(value.origin) for path, value in talker.parameters.leaves()}
    assert origins == {
        ("rate",): "base.yaml:7:24, from lab1.yaml:2:42",
        ("name",): "lab1.yaml:5:24",
        ("noise", "imu"): "command line",
        ("noise", "joints"): "base.yaml:7:76",
    }


def test_later_override_wins(folder):
    found = folder.load(TALKER, sets=["nodes.talker.restart=always", "seed=2", "seed=3"])
    assert (found.seed, found.nodes[0].supervision.restart.when) == (3, Restart.ALWAYS)


def test_resolved_file_loads_and_has_no_expressions(folder):
    folder.write("", "plugins/talker.py")
    folder.write("x: 1\n", "p.yaml")
    folder.write("args: {n: {type: int}}\nnodes: {in: {plugin: talker, parameters: {n: '${args.n}'}}}\n", "in.yaml")
    found = folder.load("""
        plugins: [plugins]
        namespace: ns
        include: [{file: in.yaml, args: {n: 4}, namespace: inner}]
        topics: {t: {qos: {depth: 2}}}
        nodes: {talker: {plugin: talker, parameters_from: p.yaml}}
    """)
    assert found.resolved is not None
    assert found.resolved.data == {
        "plugins": [str(folder.path / "plugins")],
        "topics": {"/ns/t": {"qos": {"depth": 2}}},
        "nodes": {
            "ns/inner/in": {"plugin": "talker", "parameters": {"n": 4}},
            "ns/talker": {"plugin": "talker", "parameters": {"x": 1}},
        },
    }
    again = folder.load(json.dumps(found.resolved.data))
    assert again.resolved is not None
    assert again.resolved.data == found.resolved.data


def test_problems_of_all_stages_are_sorted_together(folder):
    report = folder.report(
        """
        args: {rate: {type: float, default: fast}}
        node: {}
        include: [nowhere.yaml]
        topics:
          /imu: {qos: nothing}
        nodes:
          talker: {plugin: talker, restart: allways, parameters: {a: "${args.rat}"}}
          2nd: {plugin: talker}
          third: {}
        """,
        sets=["nodes.fourth.restart=never"],
        assignments=["speed:=1"],
    )
    starts = [line.partition(" error: ")[0] for line in report.splitlines() if " error: " in line]
    assert starts == [
        "command line:1:1:",
        "command line:1:1:",
        "lab1.yaml:2:37:",
        "lab1.yaml:3:1:",
        "lab1.yaml:4:11:",
        "lab1.yaml:6:15:",
        "lab1.yaml:8:37:",
        "lab1.yaml:8:65:",
        "lab1.yaml:9:3:",
        "lab1.yaml:10:3:",
    ]


def test_examine_returns_description_beside_problems(folder):
    folder.write(TALKER + "  second: {plugin: 5}\nseed: x\n")
    found, problems = examine("lab1.yaml", environment={})
    assert found is not None
    assert ([each.name for each in found.nodes], len(problems)) == (["talker"], 2)
    with pytest.raises(LaunchError) as caught:
        load("lab1.yaml", environment={})
    assert caught.value.problems == problems


@pytest.mark.parametrize("name", ["$(touch x)", "`touch x`", "a; touch x", "../x", "\\e]0;x\\a", "\\0", "名前", ""])
def test_hostile_node_name_is_refused_and_escaped(folder, name: str):
    report = folder.report(f'nodes:\n  "{name}": {{plugin: talker}}\n')
    assert report.startswith("lab1.yaml:2:3: error: ")
    assert all(line == printable(line) for line in report.split("\n"))


@given(st.data())
def test_any_tree_loads_or_is_refused(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject):
    words = st.sampled_from(
        ["nodes", "plugin", "talker", "args", "type", "default", "float", "qos", "topics", "depth", "/imu", "include",
         "lab1.yaml", "parameters", "parameters_from", "remap", "namespace", "clock", "mode", "sim", "seed", "x-a",
         "${args.a}", "${", "plugins", ".", "publishers", "restart", "name", "shutdown", "grace", "50ms", "", "~"]
    )  # fmt: skip
    leaf = st.one_of(words, st.integers(-3, 3), st.booleans(), st.none(), st.floats(allow_nan=False))
    tree = st.recursive(leaf, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(words, inner, max_size=4))
    path = tmp_path_factory.mktemp("any") / "lab1.yaml"
    path.write_text(json.dumps(data.draw(st.dictionaries(words, tree, max_size=5))).replace("Infinity", "1"))
    _, problems = examine(path, environment={})
    for problem in problems:
        assert all(line == printable(line, limit=10_000) for line in problem.render().split("\n"))
