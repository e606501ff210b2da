"""Overrides: `--set path=value`, with mistakes reported at their column."""

import re
from pathlib import Path

import pytest

from busflow.launchfile.load.override import SETTABLE

FILE = """
qos: {fast: {depth: 1}}
topics: {/imu: {qos: fast}}
nodes:
  talker: {plugin: talker, parameters: {rate: 1.0, gains: [1, 2], noise: {imu: 0.1}}}
  left/camera: {plugin: camera}
  right/camera: {plugin: camera}
  left/lidar: {plugin: lidar}
"""


@pytest.mark.parametrize(
    ("text", "path", "expected"),
    [
        ("nodes.talker.parameters.rate=5", "nodes.talker.parameters.rate", 5),
        ("nodes.talker.parameters.noise.imu=0.5", "nodes.talker.parameters.noise", {"imu": 0.5}),
        ("nodes.talker.parameters.noise={imu: 3}", "nodes.talker.parameters.noise", {"imu": 3}),
        ("nodes.talker.parameters.new.deep=on", "nodes.talker.parameters.new", {"deep": "on"}),
        ("nodes.talker.parameters.gains.1=9", "nodes.talker.parameters.gains", [1, 9]),
        ('nodes.talker.parameters.rate="5"', "nodes.talker.parameters.rate", "5"),
        ("nodes./talker.restart=always", "nodes.talker.restart", "always"),
        ("nodes.lidar.restart=always", "nodes.left/lidar.restart", "always"),
        ("nodes.left/camera.restart=always", "nodes.left/camera.restart", "always"),
        ("topics./imu.qos=sensor_data", "topics./imu.qos", "sensor_data"),
        ("topics.joints.qos.depth=3", "topics./joints.qos", {"depth": 3}),
        ("qos.fast.depth=7", "qos.fast", {"depth": 7}),
        ("seed=7", "seed", 7),
        ("clock.mode=sim", "clock.mode", "sim"),
        ("shutdown.grace=2s", "shutdown.grace", "2s"),
        ("name=other", "name", "other"),
    ],
)
def test_a_value_is_set_by_its_path(folder, text: str, path: str, expected: object):
    found = folder.load(FILE, sets=[text]).resolved.find(tuple(path.split(".")))
    assert found.data == expected
    assert str(list(found.leaves())[-1][1].origin) == "command line"


def test_other_values_keep_their_origin(folder):
    found = folder.load(FILE, sets=["nodes.talker.parameters.gains.1=9"]).nodes[0].parameters
    assert [str(value.origin) for _, value in found.find(("gains",)).leaves()] == ["lab1.yaml:5:60", "command line"]


@pytest.mark.parametrize(
    ("text", "column", "message", "fix"),
    [
        ("nodes.tlker.restart=always", 1, "there is no node tlker", "did you mean 'talker'?"),
        ("nodes.camera.restart=always", 1, "there is no node camera", "did you mean 'left/camera'?"),
        ("nodes.talker.restrt=always", 1, "unknown key nodes.talker.restrt", "did you mean 'restart'?"),
        (
            "clock.mode=sym",
            12,
            "clock.mode must be one of system, sim, follow, got text 'sym'",
            "did you mean 'system'?",
        ),
        ("qos.fast.depth.x=1", 1, "qos.fast.depth is 1; it has no x", "set qos.fast.depth itself"),
        ("topics.imu.qos.depth=1", 1, "topics./imu.qos is text 'fast'; it has no depth", "set topics./imu.qos itself"),
        ("qos.fast.depth=0", 16, "depth must be at least 1, got 0", "allowed: at least 1"),
        ("talker.rate=1", 1, "talker cannot be set", "write nodes.talker.parameters.rate=…"),
        ("talker.restart=always", 1, "talker cannot be set", "write nodes.talker.restart=…"),
        ("args.rate=1", 1, "args cannot be set", "write rate:=… without --set"),
        (
            "include=[a]",
            1,
            "include cannot be set",
            "known: clock, expect, frames, machines, name, network, nodes, packages … and 7 more",
        ),
        ("sed=1", 1, "sed cannot be set", "did you mean 'seed'?"),
        (
            "nodes.talker.for_each={n: [1, 2]}",
            1,
            "for_each has made its nodes already",
            "set a value of one of these nodes",
        ),
        ("seed=x", 6, "seed must be a whole number, got text 'x'", None),
        ("name=", 6, "there is no value", "for an empty text write name='\"\"'"),
        ("nodes.talker.parameters.gains=[1", 31, "this bracket is never closed with ']'", "write ] where it ends"),
    ],
)
def test_wrong_override_is_reported_at_its_column(folder, text: str, column: int, message: str, fix: str | None):
    first, _, _, *remedy = folder.report(FILE, sets=[text]).splitlines()
    assert first == f"command line:1:{column}: error: {message}"
    assert [line.strip().removeprefix("fix: ") for line in remedy] == ([fix] if fix else [])


def test_parameter_file_is_laid_over_the_node(folder):
    path = folder.write("noise: {joints: 2.0}\ngains: [7]\nrate: 3.0\n", "more.yaml")
    sets = [f"nodes.talker.parameters_from={path}", "nodes.talker.parameters.rate=5"]
    found = folder.load(FILE, sets=sets).nodes[0].parameters
    assert found.data == {"rate": 5, "gains": [7], "noise": {"imu": 0.1, "joints": 2.0}}
    assert str(found.find(("gains", 0)).origin) == f"{path}:2:9"


def test_missing_parameter_file_is_an_error(folder):
    """Case file/136."""
    assert "cannot read nope.yaml" in folder.report(FILE, sets=["nodes.talker.parameters_from=nope.yaml"])


def test_an_index_must_be_within_its_list(folder, golden):
    report = folder.report(FILE, sets=["nodes.talker.parameters.gains.2=1"])
    golden(report)


@pytest.mark.parametrize("text", ["nodes.talker", "nodes..rate=1", "=1", "a." * 100 + "b=1", ""])
def test_malformed_override_is_refused(folder, text: str, golden):
    report = folder.report(FILE, sets=[text])
    golden(report)


def test_docs_list_the_settable_keys():
    page = (Path(__file__).parents[3] / "docs/launch-files.md").read_text()
    stated = re.search(
        r"`--set` takes a path of keys with dots between them: (.*?), and what is below them\.", page, re.DOTALL
    )
    assert stated is not None
    assert sorted(re.findall(r"`(\w+)`", stated[1])) == sorted(SETTABLE)
