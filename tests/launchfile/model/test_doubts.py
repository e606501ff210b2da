"""Doubts: unknown facts about a graph, derived from the keys that mistakes removed."""

import pytest

from busflow.launchfile.load.load import examine
from busflow.launchfile.model.doubts import Doubt, doubts


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ((), Doubt.NODES),
        (("nodes", "talker"), Doubt.NODES),
        (("nodes", "talker", "plugin"), Doubt.NODES),
        (("nodes", "talker", "remap", "imu"), Doubt.NODES),
        (("nodes", "talker", "parameters", "rate_hz"), Doubt.PARAMETERS),
        (("nodes", "talker", "parameters_from"), Doubt.PARAMETERS),
        (("nodes", "talker", "publishers", "imu", "depth"), Doubt.QOS),
        (("nodes", "talker", "restart"), None),
        (("groups", "arm", "nodes", "talker", "process"), None),
        (("groups", "arm", "defaults", "parameters"), Doubt.PARAMETERS),
        (("plugins", 0), Doubt.PLUGINS),
        (("topics", "/imu", "qos"), Doubt.QOS),
        (("record", "to"), None),
        (("profiles", "fast", "nodes", "talker"), None),
        (("x-own", "nodes"), None),
    ],
)
def test_each_doubt_is_raised_for_its_key(path, expected):
    assert doubts([path]) == ({expected} if expected else set())


def test_repeated_mapping_causes_no_doubt_elsewhere(folder):
    folder.write("""\
        plugins: [plugins]
        clock: {mode: sim}
        clock: {rate: 2}
        nodes:
          talker:
            plugin: talker
            parameters: {sides: [left, right]}
        """)
    (folder.path / "plugins").mkdir()
    description, problems = examine("lab1.yaml")
    assert [each.code for each in problems] == ["duplicate-key"]
    assert description is not None
    assert description.doubts == set()
