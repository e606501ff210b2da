"""Parameter files in ROS 2's form: which sections are a node's, which value wins, and what is written comes back."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.launchfile.load.parameter_file import of_node, text_for
from busflow.launchfile.yaml.document import parse

SELECTORS = """\
/**: {ros__parameters: {all: 1}}
/**/hand: {ros__parameters: {hands: 1}}
/*/hand: {ros__parameters: {hands_one_below: 1}}
left: {hand: {ros__parameters: {own: 1}}, "*": {ros__parameters: {beside: 1}}}
/left/**: {ros__parameters: {left: 1}}
hand: {ros__parameters: {root: 1}}
"*": {ros__parameters: {in_root: 1}}
/: {hand: {ros__parameters: {root_by_slash: 1}}}
/**/left/*/finger: {ros__parameters: {finger: 1}}
right: {hand: {ros__parameters: {wrong: 1}}}
"""


def own(text: str, node: str) -> Any:
    file = parse(text.encode(), "p.yaml")
    return of_node(file, node, file.origin).data


@pytest.mark.parametrize(
    ("node", "names"),
    [
        ("/left/hand", ["all", "hands", "hands_one_below", "own", "beside", "left"]),
        ("/hand", ["all", "hands", "root", "in_root", "root_by_slash"]),
        ("/robot/left/arm/finger", ["all", "finger"]),
        ("/left", ["all", "left", "in_root"]),
    ],
)
def test_sections_are_chosen_as_in_ros(node: str, names: list[str]):
    """Case semantics/wildcard-special-names, and sections with other wildcards."""
    assert list(own(SELECTORS, node)) == names


def test_later_section_and_file_win(folder):
    folder.write("/a: {ros__parameters: {x: 1, y: 1, n.i: 1}}\n/**: {ros__parameters: {x: 2}}\n", "one.yaml")
    folder.write("/*: {ros__parameters: {y: 3, n: {j: 3}}}\n", "two.yaml")
    folder.write("x: 4\n", "plain.yaml")
    node = folder.load("nodes: {a: {plugin: p, parameters_from: [one.yaml, two.yaml], parameters: {z: 5}}}\n").nodes[0]
    assert node.parameters.data == {"x": 2, "y": 3, "n": {"i": 1, "j": 3}, "z": 5}
    assert str(node.parameters.find(("n", "i")).origin) == "one.yaml:1:41"
    node = folder.load("nodes: {a: {plugin: p, parameters_from: [one.yaml, plain.yaml]}}\n").nodes[0]
    assert node.parameters.data == {"x": 4, "y": 1, "n": {"i": 1}}


def test_node_is_known_by_its_full_name(folder, golden):
    folder.write("/robot/left/arm/c/a: {ros__parameters: {x: 1}}\n", "p.yaml")
    folder.write("/robot/left/arm/c/b: {ros__parameters: {x: 2}}\n", "q.yaml")
    folder.write("namespace: arm\nnodes: {a: {plugin: p, namespace: c, parameters_from: p.yaml}}\n", "part.yaml")
    found = folder.load("""
        namespace: robot
        include: [{file: part.yaml, namespace: left}]
        groups:
          g: {namespace: left/arm, nodes: {c/b: {plugin: p, parameters_from: q.yaml}}}
    """)
    assert {node.full_name: node.parameters.data for node in found.nodes} == {
        "/robot/left/arm/c/a": {"x": 1},
        "/robot/left/arm/c/b": {"x": 2},
    }
    report = folder.report("nodes: {left/a: {plugin: p}}\n", sets=["nodes.a.parameters_from=p.yaml"])
    golden(report.splitlines()[0])


def test_expression_in_ros_form_is_text(folder):
    folder.write("/**: {ros__parameters: {x: '${args.nope}'}}\n", "p.yaml")
    assert folder.load("nodes: {a: {plugin: p, parameters_from: p.yaml}}\n").nodes[0].parameters.data == {
        "x": "${args.nope}"
    }


def test_file_without_the_node_is_an_error(folder, golden):
    folder.write("/left/camera: {ros__parameters: {x: 1}}\n/imu: {ros__parameters: {x: 1}}\n", "p.yaml")
    golden(folder.report("nodes:\n  camera: {plugin: p, parameters_from: p.yaml}\n"))


def test_section_that_misses_by_wildcard_is_explained(folder, golden):
    folder.write("/*/camera: {ros__parameters: {x: 1}}\n", "p.yaml")
    golden(folder.report("nodes:\n  camera: {plugin: p, parameters_from: p.yaml}\n").splitlines()[-1])


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("ros__parameters: {x: 1}", "1:1", "ros__parameters: has no node above it"),
        ("/a: {ros__parameters: [1]}", "1:6", "ros__parameters: must be a mapping"),
        ("/a: {ros__parameters: {}}\n/b:", "2:1", "ros__parameters: is missing below /b"),
        ("/a: {x: 1, ros__parameters: {}}", "1:6", "ros__parameters: is missing below x"),
        ("/a: {x: 1}", "1:1", "ros__parameters: is missing below /a"),
        ("/a: {/b: {ros__parameters: {}}}", "1:6", "/b is not the name of a node: it is empty; give it a name"),
        ("/a*: {ros__parameters: {}}", "1:1", "/a* is not the name of a node: '*' is not allowed;"),
        (f"/a: {{ros__parameters: {{{'x.' * 70}x: 1}}}}", "1:24", "a parameter is nested deeper than 64 levels"),
    ],
)
def test_wrong_section_is_reported_at_its_key(folder, text: str, place: str, message: str):
    folder.write(text + "\n", "p.yaml")
    report = folder.report("nodes: {a: {plugin: p, parameters_from: p.yaml}}\n")
    assert report.startswith(f"p.yaml:{place}: error: {message}")


_SCALARS = st.none() | st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False)
_NO_TEXT_TO_SOME_READERS = ["1e3", "0o17", "0x1F", "1_000", "12:30", "yes", "Null", "~", "=", "1" * 70, "${x}", ""]
_TEXTS = st.text() | st.sampled_from(_NO_TEXT_TO_SOME_READERS)


@given(st.dictionaries(st.sampled_from("abcd"), _SCALARS | _TEXTS | st.lists(_SCALARS | _TEXTS), min_size=1))
def test_written_parameters_come_back_unchanged(values: dict[str, Any]):
    assert own(text_for("/left/hand", values), "/left/hand") == values
