"""`Resolver`: replaced expressions, and ROS 2's cases of conditions, substitutions and parameters."""

import json
from pathlib import Path
from typing import Any

import pytest

from busflow.errors import LaunchError
from busflow.launchfile.load.expression import Scope
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.problems import Problems
from busflow.launchfile.yaml.value import Origin, StatedBy, Value

CASES: list[dict[str, Any]] = json.loads((Path(__file__).parents[2] / "cases" / "i_launch.json").read_text())["cases"]
OF_OTHER_MODULES = {"coerce", "ns_push", "ns_make_absolute", "node_parameter_from_substitution"}
"""Kinds of cases that other test modules test."""
SKIPPED = {
    "substitution": "another grammar: an expression is ${…}, never $(…), and calls nothing",
    "eval": "upstream runs Python here; an expression of busflow compares and combines, it does not calculate",
    "parse_if_substitutions": "about upstream's Python objects; a value of busflow is resolved wherever it stands",
    "command_line": "about the command of a child process; a node of busflow is a class",
    "ns_is_absolute": "a helper of upstream's; busflow.names decides it, with the cases of names",
    "ns_is_root": "a helper of upstream's; busflow.names decides it, with the cases of names",
    "remap_rule_shape": "about a tuple in Python; a remap of busflow is a mapping in the file",
    "any/085": "an expression has no empty any()",
    "or/090": "what `true or` leaves undecided is nothing: the rest is not looked at",
    "any/092": "what `true or` leaves undecided is nothing: the rest is not looked at",
    "yaml/executable": "busflow starts no executables from a launch file",
    "yaml/group-scoped": "there is no `let`: a value is an argument, and a group has no variables of its own",
    "yaml/reset": "there is no `let`, and so nothing to reset",
    "yaml/log": "a launch file of busflow runs nothing, and logs nothing",
    "1": "a number is not a condition: 1 and 0 are refused where true or false is meant",
}
"""Reason why a case does not apply to busflow, by kind, by id, or by an operand."""
TESTED = [case for case in CASES if case["kind"] not in OF_OTHER_MODULES]


def reason(case: dict[str, Any]) -> str | None:
    """Return why a case does not apply."""
    operands = case.get("input") if isinstance(case.get("input"), list) else [case.get("input")]
    numbers = case["kind"] in {"and", "or", "not"} and {"0", "1"} & {str(each) for each in operands or []}
    return SKIPPED.get(case["id"]) or SKIPPED.get(case["kind"]) or (SKIPPED["1"] if numbers else None)


def when(folder, value: str) -> bool:
    """Return whether a node with this `when` is part of the graph."""
    nodes = folder.load(f"nodes:\n  it: {{plugin: talker, when: {value}}}\n  other: {{plugin: talker}}\n").nodes
    return "it" in [node.name for node in nodes]


@pytest.mark.parametrize("case", TESTED, ids=lambda case: case["id"])
def test_upstream_launch_cases_agree(folder, case: dict[str, Any]):
    if (why := reason(case)) is not None:
        pytest.skip(why)
    given, expected = case["input"], case["expect"]
    if case["kind"] == "node_parameters":
        parameters = given[0] if isinstance(given, list) else given
        text = f"nodes:\n  it: {{plugin: talker, parameters: {json.dumps(parameters)}}}\n"
        if isinstance(expected, dict):
            with pytest.raises(LaunchError, match="must be a mapping"):
                folder.load(text)
        else:
            assert folder.load(text).nodes[0].parameters.data == expected[0]
        return
    word = {"any": "or", "all": "and"}.get(case["kind"], case["kind"])
    written = given if word == "condition" else f"'${{{f' {word} '.join(map(_operand, given))}}}'"
    if isinstance(expected, dict):
        with pytest.raises(LaunchError, match=r"true or false|unknown name"):
            when(folder, written or "''")
    else:
        assert when(folder, written) is (str(expected).lower() == "true")


def _operand(text: str) -> str:
    return text.lower() if text.lower() in {"true", "false"} else json.dumps(text)


def test_every_reason_belongs_to_a_skipped_case():
    used = {reason(case) for case in TESTED}
    assert set(SKIPPED.values()) <= used


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
    assert [each.message for each in problems.sorted(())] == ["a key cannot hold an expression"]
