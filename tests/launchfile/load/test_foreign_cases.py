"""Cases of ROS 2's parameters and launch files that no other adapter reads: values, overrides, whole files."""

import json
from functools import reduce
from operator import getitem, itemgetter
from typing import Any

import pytest
from pydantic import create_model

from busflow import Parameters
from busflow.errors import InvalidParameter, LaunchError
from busflow.launchfile.load.load import examine
from busflow.launchfile.yaml.document import parse_value
from busflow.node.parameters import validate
from tests.vectors import cases, each_case


def _parameter_of(kind: Any) -> type[Parameters]:
    return create_model("Typed", __base__=Parameters, value=(kind, ...))


VALUES = cases("f_parameters", "parse_cli_value/")
VALUES += [case for case in cases("i_launch", "coerce/") if "to" not in case["input"]]


@pytest.mark.parametrize("case", VALUES, ids=itemgetter("id"))
def test_text_is_a_value_of_its_type(case: dict[str, Any]):
    given, expected = case["input"], case["expect"]
    text = given["text"] if isinstance(given, dict) else given
    if isinstance(expected, dict):
        with pytest.raises((InvalidParameter, LaunchError)):
            validate(_parameter_of(list[str]), {"value": parse_value(text, "command line").data})
        return
    if not isinstance(given, dict):
        kind, expected = expected
        assert kind.removesuffix("[]") == type(expected[0] if isinstance(expected, list) else expected).__name__
    found = parse_value(text, "command line").data
    assert (repr(found), type(found)) == (repr(expected), type(expected))


@each_case("f_parameters", "yaml_sequence/")
def test_sequence_has_the_type_of_its_parameter(case: dict[str, Any]):
    given: Any = parse_value(case["input"], "command line").data
    model = _parameter_of(list[type(given[0])])  # type: ignore[misc]  # as of the first item
    if isinstance(case["expect"], str):
        with pytest.raises(InvalidParameter):
            validate(model, {"value": given})
    else:
        assert validate(model, {"value": given}).value == case["expect"][1]  # type: ignore[attr-defined]  # of Typed


@each_case("f_parameters", "override_value/")
def test_an_override_names_node_and_parameter(folder: Any, case: dict[str, Any]):
    given = {key: value.replace(" ", "_") for key, value in case["input"].items()}  # a name has no space here
    folder.write("nodes: {node_name: {plugin: a}}\n")
    override = f"nodes.{given['node']}.parameters.{given['param']}={given['value']}"
    description, problems = examine("lab1.yaml", sets=[override], environment={})
    assert (not problems) is case["expect"]["ok"]
    if description is not None and case["expect"]["ok"]:
        assert description.nodes[0].parameters.data == {"param_name": True}


@each_case("f_parameters", "params_file/")
def test_parameter_file_is_read_or_refused(folder: Any, case: dict[str, Any]):
    folder.write(case["input"]["yaml"], "p.yaml")
    if not case["expect"]["ok"]:
        model = create_model("Lidar", __base__=Parameters, id=(int, 0), name=(str, ""))
        with pytest.raises((LaunchError, InvalidParameter)):
            validate(model, _parameters(folder, "lidar_ns/lidar_1"))
        return
    for node, values in case["expect"].get("values", {"intel": {"num_cores": 8}}).items():
        found = _parameters(folder, node)
        for name, value in values.items():
            data = reduce(getitem, name.split("."), found)
            assert json.dumps(data) == json.dumps(data if "nan" in str(value) else value)
            assert [str(each) for each in data] == [str(each) for each in value] if isinstance(value, list) else True


@each_case("f_parameters", "params_select/")
def test_sections_of_a_node_are_chosen(folder: Any, case: dict[str, Any]):
    folder.write(case["input"]["yaml"], "p.yaml")
    assert _parameters(folder, f"{case['input']['namespace']}/{case['input']['node']}") == case["expect"]["values"]


def _parameters(folder: Any, node: str) -> Any:
    """Return what a node reads from the parameter file `p.yaml`."""
    return folder.load(f"nodes: {{{node}: {{plugin: a, parameters_from: p.yaml}}}}\n").nodes[0].parameters.data


def test_many_nodes_and_parameters_are_read(folder: Any):
    """Cases params_scale/128 and params_scale/129."""
    nodes = folder.load("nodes:\n" + "".join(f"  n{n}: {{plugin: a, parameters: {{p: {n}}}}}\n" for n in range(513)))
    assert [node.parameters.data["p"] for node in nodes.nodes] == list(range(513))
    folder.write("".join(f"p{n}: {n}\n" for n in range(513)), "p.yaml")
    (node,) = folder.load("nodes: {a: {plugin: a, parameters_from: p.yaml}}\n").nodes
    assert node.parameters.data == {f"p{n}": n for n in range(513)}


@each_case("i_launch", "node_parameter_from_substitution/")
def test_parameter_takes_the_type_of_its_argument(folder: Any, case: dict[str, Any]):
    value = case["expect"]
    kind = f"list[{type(value[0]).__name__}]" if isinstance(value, list) else type(value).__name__
    folder.write(f"args: {{it: {{type: '{kind}'}}}}\nnodes: {{a: {{plugin: a, parameters: {{p: '${{args.it}}'}}}}}}\n")
    description, problems = examine("lab1.yaml", assignments=[f"it:={case['input']}"], environment={})
    assert not problems
    assert description is not None
    assert description.nodes[0].parameters.data == {"p": value}
