"""Merging parts of several files: repeated settings, and namespaces as ROS 2 composes them."""

from typing import Any

from busflow.launchfile.load.merge import compose
from tests.vectors import each_case

TALKER = "nodes:\n  talker:\n    plugin: talker\n"


def test_included_files_may_say_the_same(folder):
    folder.write("seed: 1\nqos: {a: {depth: 2}}\nnodes: {a: {plugin: p}}\n", "a.yaml")
    folder.write("seed: 1\nqos: {a: {depth: 2}}\nnodes: {b: {plugin: p}}\n", "b.yaml")
    assert folder.load("include: [a.yaml, b.yaml]\n").seed == 1


def test_included_files_that_disagree_are_a_mistake(folder, golden):
    folder.write("seed: 1\nnodes: {a: {plugin: p}}\n", "a.yaml")
    folder.write("seed: 2\nnodes: {b: {plugin: p}}\n", "b.yaml")
    golden(folder.report("include: [a.yaml, b.yaml]\n"))


def test_the_including_file_decides_where_its_includes_disagree(folder):
    folder.write("seed: 1\nnodes: {a: {plugin: p}}\n", "a.yaml")
    folder.write("seed: 2\nnodes: {b: {plugin: p}}\n", "b.yaml")
    assert folder.load("seed: 3\ninclude: [a.yaml, b.yaml]\n").seed == 3


def test_one_file_included_twice_needs_two_namespaces(folder, golden):
    folder.write(TALKER, "a.yaml")
    golden(folder.report("include: [a.yaml, a.yaml]\n"))
    found = folder.load("include: [a.yaml, {file: a.yaml, namespace: left}]\n")
    assert [each.full_name for each in found.nodes] == ["/talker", "/left/talker"]


def test_node_without_plugin_changes_the_included_node(folder):
    folder.write("namespace: left\n" + TALKER + "    parameters: {a: 1, b: 1}\n", "a.yaml")
    (found,) = folder.load("include: [a.yaml]\nnodes:\n  left/talker: {parameters: {a: 2}, restart: always}\n").nodes
    assert (found.parameters.data, found.supervision.restart.when.value) == ({"a": 2, "b": 1}, "always")


def test_two_keys_of_one_node_are_a_mistake(folder, golden):
    report = folder.report("nodes:\n  left/a: {plugin: p}\n  a: {plugin: p, namespace: left}\n")
    golden(report)


@each_case("i_launch", "ns_push/", "ns_make_absolute/")
def test_namespaces_are_composed_as_ros_2_launch_does(case: dict[str, Any]):
    outer, inner = case["input"] if case["kind"] == "ns_push" else ("", case["input"])
    composed = compose(compose("/", outer), inner)
    # Theirs may stay relative until the node is made; here the root is known from the start.
    assert composed == f"/{case['expect'].removeprefix('/')}"
