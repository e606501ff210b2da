"""Tests of `description.py`, `keys.py`, `section.py`, `supervision.py` and `key_faults.py`."""

import pytest

from busflow.errors import InvalidDeclaration
from busflow.launchfile.model.key_faults import checked
from busflow.launchfile.model.keys import LaunchKeys
from busflow.launchfile.model.problems import Problems
from busflow.launchfile.model.supervision import RestartPolicy
from busflow.launchfile.yaml.document import parse


def test_full_names_include_the_namespace(folder):
    found = folder.load(
        "namespace: lab\nnodes:\n  left/talker: {plugin: p, publishers: {numbers: {depth: 2}, /all: {depth: 3}}}\n"
    )
    (node,) = found.nodes
    assert node.full_name == "/lab/left/talker"
    topics = [each.full_topic(node.name, node.namespace) for each in node.publishers]
    assert topics == ["/lab/left/numbers", "/all"]


@pytest.mark.parametrize(
    ("short", "long"),
    [
        ({"nodes": {"a": {"restart": "always"}}}, {"nodes": {"a": {"restart": {"policy": "always"}}}}),
        ({"include": "a.yaml"}, {"include": [{"file": "a.yaml"}]}),
        ({"record": "run.mcap"}, {"record": {"to": "run.mcap"}}),
        ({"seed": None, "x-own": 1}, {}),
    ],
)
def test_short_forms_equal_their_long_forms(short, long):
    assert LaunchKeys.model_validate(short) == LaunchKeys.model_validate(long)


@pytest.mark.parametrize(
    ("text", "code", "kept"),
    [
        (
            "nodes: {a: {plugin: p, remapp: {x: y}}}",
            "unknown-key",
            {"nodes": {"a": {"plugin": "p", "remap": {"x": "y"}}}},
        ),
        ("nodes: {a: {plugin: p, colour: red}}", "unknown-key", {"nodes": {"a": {"plugin": "p"}}}),
        ("plugins: folder\nnodes: {}", "wrong-type", {"plugins": ["folder"], "nodes": {}}),
        ("nodes: {a: {plugin: 5}, b: {plugin: p}}", "wrong-type", {"nodes": {"b": {"plugin": "p"}}}),
        ("version: 1", "later-key", {}),
    ],
)
def test_wrong_key_is_reported_and_corrected_or_removed(text, code, kept):
    problems = Problems()
    _, tree = checked(parse(text.encode(), "lab1.yaml"), problems)
    assert [each.code for each in problems.sorted(["lab1.yaml"])] == [code]
    assert tree.data == kept


@pytest.mark.parametrize(
    "limits",
    [{"most": 0}, {"first_s": 0}, {"first_s": 2, "longest_s": 1}, {"window_s": 0}],
    ids=lambda limits: next(iter(limits)),
)
def test_limits_of_restarts_are_possible(limits, golden):
    with golden.raises(InvalidDeclaration):
        RestartPolicy(**limits)
