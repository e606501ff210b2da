"""Arguments: typed, ranged, given by a command line, a caller or a default."""

from operator import itemgetter
from typing import Any

import numpy as np
import pytest

from busflow.launchfile.load.load import examine, read_arguments
from tests.vectors import cases

FILE = """
args:
  rate_hz: {type: float, default: 10, min: 0.1, max: 1000, help: How often.}
  count: {type: int, default: 3}
  side: {type: str, default: left, choices: [left, right, on]}
  debug: {type: bool, default: false}
  gains: {type: "list[float]", default: [1, 2.5], min: 0}
  names: {type: "list[str]", default: []}
nodes:
  talker:
    plugin: talker
    parameters:
      rate_hz: ${args.rate_hz}
      count: ${args.count}
      side: ${args.side}
      debug: ${args.debug}
      gains: ${args.gains}
      names: ${args.names}
"""


def values(folder, **how: Any) -> dict[str, object]:
    return folder.load(FILE, **how).nodes[0].parameters.data


def test_defaults_are_taken_as_the_declared_type(folder):
    found = values(folder)
    assert found == {"rate_hz": 10.0, "count": 3, "side": "left", "debug": False, "gains": [1, 2.5], "names": []}
    assert type(found["rate_hz"]) is float


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        ("rate_hz:=50", "rate_hz", 50.0),
        ("rate_hz:=1e2", "rate_hz", 100.0),
        ("count:=010", "count", 10),
        ("side:=on", "side", "on"),
        ("debug:=true", "debug", True),
        ("gains:=[0.5, 1]", "gains", [0.5, 1]),
        ("names:=[on, 'a b']", "names", ["on", "a b"]),
    ],
)
def test_the_command_line_beats_the_default(folder, text: str, name: str, value: object):
    found = values(folder, assignments=[text])[name]
    assert (found, type(found)) == (value, type(value))


def test_string_argument_is_never_read_as_yaml(folder):
    text = "args: {name: {type: str}}\nnodes: {talker: {plugin: talker, parameters: {name: '${args.name}'}}}\n"
    for value in ("010", "true", "[a", '"x"', "~", "", "a: b"):
        (node,) = folder.load(text, assignments=[f"name:={value}"]).nodes
        assert node.parameters.data == {"name": value}


@pytest.mark.parametrize("value", [50, 50.0, np.float32(50), np.int64(50)])
def test_a_caller_passes_typed_values(folder, value: object):
    assert values(folder, args={"rate_hz": value})["rate_hz"] == 50.0


@pytest.mark.parametrize(
    ("text", "column", "message", "fix"),
    [
        ("rate:=1", 1, "unknown argument rate", "did you mean 'rate_hz'?"),
        ("rate_hz:=fast", 10, "argument rate_hz must be a number, got text 'fast'", None),
        ("rate_hz:=", 10, "argument rate_hz must be a number, got text ''", None),
        ("rate_hz:=0", 10, "argument rate_hz must be at least 0.1, at most 1000, got 0", None),
        ("rate_hz:=.nan", 10, "argument rate_hz must be at least 0.1, at most 1000, got .nan", None),
        ("count:=2.0", 8, "argument count must be a whole number, got 2.0", "write 2"),
        ("debug:=yes", 8, "argument debug must be true or false, got text 'yes'", "write true"),
        ("gains:=[1, -1]", 12, "argument gains[1] must be at least 0, got -1", None),
        ("gains:=[.nan]", 9, "argument gains[0] must be at least 0, got .nan", None),
        ("gains:=5", 8, "argument gains must be a list[float], got 5", None),
        ("gains:=[1", 8, "this bracket is never closed with ']'", "write ] where it ends"),
        ("names:=[1]", 9, "argument names[0] must be text, got 1", 'quote it: "1"'),
        ("names:=[0483]", 9, "argument names[0] must be text, got 483", 'quote it: "0483"'),
        ("names:=[1e3]", 9, "argument names[0] must be text, got 1000.0", 'quote it: "1e3"'),
        ("names:=[0x10]", 9, "argument names[0] must be text, got 16", 'quote it: "0x10"'),
        ("side:=rigth", 7, "argument side must be one of left, right, on, got text 'rigth'", "did you mean 'right'?"),
        ("rate_hz=50", 1, "this is not an argument", "write name:=value, for instance rate_hz:=50"),
        ("min", 1, "this is not an argument", "write the duration without a space: 5min"),
        (
            "talker",
            1,
            "this is not an argument",
            "write name:=value, for instance rate_hz:=50; busflow run --plugin talker runs a plugin without a file",
        ),
        (":=50", 1, "this is not an argument", "write name:=value, for instance rate_hz:=50"),
        ("side:=\x1b[2J", 7, "the value holds the control character U+001B", "leave it out"),
    ],
)
def test_wrong_argument_is_reported_at_its_column(folder, text: str, column: int, message: str, fix: str | None):
    report = folder.report(FILE, assignments=[text])
    first, _, _, *remedy = report.splitlines()
    assert first == f"command line:1:{column}: error: {message}"
    assert remedy == ([f"  fix: {fix}"] if fix else [])


def test_wrong_argument_of_caller_has_no_place(folder, golden):
    golden(folder.report(FILE, args={"rate_hz": "50", "count": True, "zzz": 1}))


def test_arguments_are_readable_in_a_wrong_file(folder):
    folder.write("args:\n  rate: {type: float, help: How often.}\nnodes: {a: {pluggin: 1}}\n")
    (argument,) = read_arguments("lab1.yaml", {})
    keys = argument.keys
    assert (argument.name, keys.type, argument.default, keys.help) == ("rate", "float", None, "How often.")


def test_too_many_mistakes_leave_no_arguments(folder):
    folder.write("args:\n" + "".join(f"  a{n}: {{type: int, default: x}}\n" for n in range(200)))
    assert read_arguments("lab1.yaml", {}) == ()


def test_a_default_may_come_from_the_environment(folder):
    text = "args: {lab: {type: str, default: '${env.LAB:-5}'}}\n"
    text += "nodes: {a: {plugin: a, parameters: {lab: '${args.lab}'}}}\n"
    for env, expected in (({}, "5"), ({"LAB": "010"}, "010")):
        (node,) = folder.load(text, env=env).nodes
        assert node.parameters.data == {"lab": expected}


TYPED = [case for case in cases("i_launch", "coerce/") if "to" in case["input"]]


@pytest.mark.parametrize("case", TYPED, ids=itemgetter("id"))
def test_arguments_are_coerced_as_in_ros_2_launch(folder, case: dict[str, Any]):
    kind = case["input"]["to"]
    kind = f"list[{kind[:-2]}]" if kind.endswith("[]") else kind
    folder.write(f"args: {{it: {{type: '{kind}'}}}}\nnodes: {{a: {{plugin: a, parameters: {{it: '${{args.it}}'}}}}}}\n")
    description, problems = examine("lab1.yaml", assignments=[f"it:={case['input']['text']}"], environment={})
    if isinstance(case["expect"], dict):
        assert problems
    else:
        assert description is not None
        assert not problems
        assert description.nodes[0].parameters.data == {"it": case["expect"]}
