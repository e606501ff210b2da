"""Expansion: `for_each` makes the product of its lists, and `when` includes or omits entries."""

import json
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.launchfile.model.description import LaunchDescription

ARMS = """
    args:
      sides: {type: 'list[str]', default: [left, right]}
    nodes:
      imu:
        for_each: {side: "${args.sides}"}
        plugin: talker
        namespace: ${each.side}
        remap: {imu: "/imu/${each.side}"}
        parameters: {frame: "${each.side}_imu"}
"""


def names(found: LaunchDescription) -> list[str]:
    return [each.full_name for each in found.nodes]


def test_for_each_makes_one_node_per_item(folder):
    found = folder.load(ARMS)
    assert names(found) == ["/left/imu", "/right/imu"]
    assert [each.parameters.data for each in found.nodes] == [{"frame": "left_imu"}, {"frame": "right_imu"}]
    assert [rule.replacement for each in found.nodes for rule in each.remap] == ["/imu/left", "/imu/right"]


def test_value_keeps_the_origin_of_its_item(folder):
    left, right = folder.load(ARMS, assignments=["sides:=[left, right]"]).nodes
    assert str(left.parameters.find(("frame",)).origin) == "lab1.yaml:10:25, from command line"
    assert (str(left.origin), str(right.origin)) == ("lab1.yaml:5:3", "lab1.yaml:5:3")


def test_a_list_may_be_empty(folder):
    assert names(folder.load(ARMS + "      other: {plugin: talker}\n", args={"sides": []})) == ["/other"]


def test_below_a_for_each_keys_may_hold_expressions(folder):
    found = folder.load("""
        nodes:
          foot_${each.n}_${each.foot.side}:
            for_each:
              n: [1, 2]
              foot: [{side: left, max: 4.5}, {side: right, max: null}]
            plugin: talker
            remap: {"${each.foot.side}/force": "/force/n${each.n}"}
            parameters: {max: "${each.foot.max}", n: "${each.n}", foot: "${each.foot}"}
        """)
    assert names(found) == ["/foot_1_left", "/foot_1_right", "/foot_2_left", "/foot_2_right"]
    assert found.nodes[2].parameters.data == {"max": 4.5, "n": 2, "foot": {"side": "left", "max": 4.5}}
    assert [(rule.match, rule.replacement) for rule in found.nodes[3].remap] == [("right/force", "/force/n2")]


def test_for_each_repeats_topics_and_includes(folder):
    folder.write("nodes: {imu: {plugin: talker}}\n", "imu.yaml")
    found = folder.load("""
        include:
          - file: imu.yaml
            for_each: {side: [left, right]}
            namespace: ${each.side}
          - file: ${each.name}.yaml
            for_each: {name: [imu]}
        topics:
          ${each.side}/imu/data:
            for_each: {side: [left, right]}
            qos: {depth: 3}
        """)
    assert names(found) == ["/left/imu", "/right/imu", "/imu"]
    assert [each.topic for each in found.topics] == ["/left/imu/data", "/right/imu/data"]


@given(lists=st.lists(st.lists(st.integers(0, 99), unique=True, max_size=4), min_size=1, max_size=3))
def test_several_variables_make_the_product(lists: list[list[int]], tmp_path_factory):
    from busflow.launchfile.load.load import examine

    key = "n" + "".join(f"_${{each.v{n}}}" for n in range(len(lists)))
    node = {"plugin": "talker", "for_each": {f"v{n}": each for n, each in enumerate(lists)}}
    node["parameters"] = {f"v{n}": f"${{each.v{n}}}" for n in range(len(lists))}
    file = tmp_path_factory.mktemp("product") / "lab.yaml"
    file.write_text(json.dumps({"nodes": {key: node, "last": {"plugin": "talker"}}}))
    found, problems = examine(file, environment={})
    assert problems == ()
    assert found is not None
    combinations = list(product(*lists))
    assert [each.name for each in found.nodes] == [
        *("n" + "".join(f"_{value}" for value in values) for values in combinations),
        "last",
    ]
    assert [tuple(each.parameters.data.values()) for each in found.nodes[:-1]] == combinations


def test_expansion_is_limited(folder, golden):
    numbers = list(range(100))
    report = folder.report(f"""
        nodes:
          n_${{each.a}}_${{each.b}}_${{each.c}}:
            plugin: talker
            for_each: {{a: {numbers}, b: {numbers}, c: {numbers}}}
        """)
    golden(report)


@pytest.mark.parametrize(("camera", "expected"), [("true", ["/camera", "/imu"]), ("false", ["/imu"])])
def test_when_includes_or_omits_an_entry(folder, camera, expected):
    folder.write("nodes: {never: {plugin: '${env.NO}'}}", "never.yaml")
    text = """
        args: {camera: {type: bool}}
        include: [{file: never.yaml, when: false}, {file: there_is_none.yaml, when: "${not true}"}]
        topics:
          camera: {when: "${args.camera}", qos: sensor_data}
        nodes:
          camera: {plugin: talker, when: "${args.camera}"}
          imu: {plugin: talker, when: true}
        """
    found = folder.load(text, assignments=[f"camera:={camera}"])
    assert names(found) == expected
    assert len(found.topics) == (camera == "true")


def test_omitted_node_needs_no_variables(folder, golden):
    text = "nodes:\n  a: {plugin: talker}\n  b: {plugin: talker, when: false, parameters: {p: '${env.PORT}'}}\n"
    assert names(folder.load(text)) == ["/a"]
    golden(folder.report(text.replace("when: false", "when: true")))


def test_when_chooses_between_nodes_of_one_name(folder):
    text = """
        nodes:
          camera:
            for_each: {kind: [real, simulated, broken]}
            when: ${each.kind == 'simulated'}
            plugin: ${each.kind}_camera
        """
    (camera,) = folder.load(text).nodes
    assert (camera.full_name, camera.plugin) == ("/camera", "simulated_camera")


def test_including_file_and_command_line_override_when(folder):
    folder.write("nodes: {a: {plugin: x}, b: {plugin: x, when: false}}", "inner.yaml")
    text = "include: inner.yaml\nnodes: {a: {when: false}, b: {when: true}}\n"
    assert names(folder.load(text)) == ["/b"]
    assert names(folder.load(text, sets=["nodes.a.when=true"])) == ["/a", "/b"]
