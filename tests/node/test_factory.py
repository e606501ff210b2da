"""Every node of a graph is built in one way, from values of its parameters or from the life before."""

import pytest

from busflow import Graph, Node, Parameters
from busflow.errors import InvalidParameter
from busflow.node.factory import NodeFactory, rebuild
from busflow.node.node import runtime_of


class ArmParameters(Parameters):
    speed: float = 1.0


class LeftArm(Node):
    parameters: ArmParameters


def test_a_node_is_named_by_factory_or_class():
    named, unnamed = NodeFactory(LeftArm, "arm"), NodeFactory(LeftArm)
    built = [each.build(each.parameters({"speed": 2})) for each in (named, unnamed)]
    assert [runtime_of(each).full_name for each in built] == ["/arm", "/left_arm"]
    assert [each.parameters.speed for each in built] == [2.0, 2.0]


def test_impossible_values_are_refused_before_building_a_node():
    with pytest.raises(InvalidParameter, match="speed"):
        NodeFactory(LeftArm).parameters({"speed": "fast"})


def test_a_rebuilt_node_keeps_surroundings_and_parameter_history():
    graph = Graph([LeftArm(speed=3.0, name="arm")])
    (planned,) = graph.plan().nodes
    planned.runtime.parameters.remember(["speed"], 4)
    again = rebuild(planned.runtime, ArmParameters(speed=5.0), 2)
    assert again.node is not planned.node
    assert (again.full_name, again.node.parameters.speed) == ("/arm", 5.0)
    assert again.surroundings.clock is planned.runtime.surroundings.clock
    assert (again.surroundings.life, planned.runtime.surroundings.life) == (2, 0)
    assert (again.parameters.set_at_run_time, again.parameters.times_set) == ({"speed"}, 4)
