"""`Resolver`: replaced expressions, and ROS 2's cases of conditions, substitutions and parameters."""

import json
from typing import Any

from busflow.errors import LaunchError
from busflow.launchfile.load.expression import Scope
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.problems import Problems
from busflow.launchfile.yaml.value import Origin, StatedBy, Value
from tests.vectors import each_case


def when(folder, value: str) -> bool:
    """Return whether a node with this `when` is part of the graph."""
    nodes = folder.load(f"nodes:\n  it: {{plugin: talker, when: {value}}}\n  other: {{plugin: talker}}\n").nodes
    return "it" in [node.name for node in nodes]


@each_case("i_launch", "substitution/")
def test_text_without_expressions_is_kept(folder, case: dict[str, Any]):
    (expected,) = case["expect"]
    text = json.dumps({"nodes": {"it": {"plugin": "talker", "parameters": {"text": case["input"]}}}})
    assert folder.load(text).nodes[0].parameters.data == expected


@each_case("i_launch", "condition/", "not/", "and/", "or/", "any/", "all/", "node_parameters/")
def test_upstream_launch_cases_agree(folder, case: dict[str, Any], golden):
    given, expected = case["input"], case["expect"]
    if case["kind"] == "node_parameters":
        parameters = given[0] if isinstance(given, list) else given
        text = f"nodes:\n  it: {{plugin: talker, parameters: {json.dumps(parameters)}}}\n"
        if isinstance(expected, dict):
            with golden.raises(LaunchError):
                folder.load(text)
        else:
            assert folder.load(text).nodes[0].parameters.data == expected[0]
        return
    word = {"any": "or", "all": "and"}.get(case["kind"], case["kind"])
    written = given if word == "condition" else f"'${{{f' {word} '.join(map(_operand, given))}}}'"
    if isinstance(expected, dict):
        with golden.raises(LaunchError):
            when(folder, written or "''")
    else:
        assert when(folder, written) is (str(expected).lower() == "true")


def _operand(text: str) -> str:
    return text.lower() if text.lower() in {"true", "false"} else json.dumps(text)


def test_failed_expression_keeps_its_text_and_path():
    origin = Origin(StatedBy.CALLER)
    resolver = Resolver(Scope({"HOST": "arm"}), Problems())
    found = resolver.resolve(Value.of({"host": "${env.HOST}", "other": ["${env.NONE}"]}, origin))
    assert found.data == {"host": "arm", "other": ["${env.NONE}"]}
    assert resolver.failed == {("other", 0)}


def test_key_holds_expressions_only_inside_for_each():
    origin = Origin(StatedBy.CALLER)
    entry = Value.of({"${each.side}/arm": 1}, origin)
    inside = Resolver(Scope({}, each={"side": Value("left", origin)}), Problems())
    assert inside.resolve(entry).data == {"left/arm": 1}
    outside = Resolver(Scope({}), problems := Problems())
    outside.resolve(entry)
    assert [each.code for each in problems.sorted(())] == ["expression"]
