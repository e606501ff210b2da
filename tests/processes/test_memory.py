"""What a process's nodes were told while they ran comes back with their next life, wherever it is."""

import json

import pytest
from pydantic import Field

from busflow import Graph, Node, Parameters, publisher, timer
from busflow.msgs.std_msgs import Int64
from busflow.node.node import runtime_of
from busflow.processes.assignment import Memory, ParameterReports
from busflow.testing import harness, virtual_time


class Noise(Parameters):
    imu: float = 0.1
    joints: float = 0.0


class SensorParameters(Parameters):
    rate_hz: float = Field(default=10.0, gt=0)
    extra: str | None = None
    noise: Noise = Noise()
    limits: Noise | None = None


class Sensor(Node):
    parameters: SensorParameters
    beats = publisher(Int64, "beats")

    def declare(self) -> None:
        if self.parameters.extra:
            self.create_publisher(Int64, self.parameters.extra)

    @timer(hz="rate_hz")
    def beat(self) -> None:
        pass


async def told_of(*changes):
    """What the voice of a process says of its nodes' parameters, when these are set."""
    told = {}
    lab = harness(Sensor)
    lab.graph.bus.observe(ParameterReports(lambda each: told.update(json.loads(json.dumps(each)))))
    async with lab:
        for change in changes:
            lab.set_parameters(Sensor, change)
    return told


def next_life(memory, node=Sensor):
    """A node that was built from a plan, and its store, with what is remembered."""
    logged = []
    graph = Graph([node], sinks=(logged.append,))
    (planned,) = memory.restored(graph.plan(), graph.log)
    return (
        planned.node,
        {each.name: (each.value, str(each.source)) for each in runtime_of(planned.node).parameters.describe()},
        logged,
    )


@virtual_time
async def test_change_is_reported_at_once_with_all_values():
    told = await told_of({"noise.imu": 0.5}, {"extra": "more"})
    assert told["/sensor"] == {
        "values": {"rate_hz": 10.0, "extra": "more", "noise": {"imu": 0.5, "joints": 0.0}, "limits": None},
        "set": ["extra", "noise.imu"],
        "times": 2,
    }


@virtual_time
async def test_change_to_same_value_is_not_reported():
    assert await told_of({"noise.imu": 0.1}) == {}


@virtual_time
async def test_restart_keeps_values_sources_and_declarations():
    told = await told_of({"noise.imu": float("inf")}, {"extra": "more"}, {"limits": {"imu": 1.0}})
    node, parameters, logged = next_life(Memory(told))
    assert node.parameters.noise.imu == float("inf")
    assert node.parameters.limits == Noise(imu=1.0)
    assert [each.topic for each in runtime_of(node).endpoints.publishers] == ["/beats", "/more"]
    assert parameters["noise.imu"] == (float("inf"), "set at run time")
    assert parameters["noise.joints"] == (0.0, "default")
    assert parameters["rate_hz"] == (10.0, "default")
    assert runtime_of(node).parameters.times_set == 3
    assert logged == []


def test_node_without_changes_follows_its_launch_file():
    node, parameters, _ = next_life(Memory({"/other": {"values": {}, "set": [], "times": 1}}))
    assert node.parameters == SensorParameters()
    assert {source for _, source in parameters.values()} == {"default"}


@pytest.mark.parametrize("values", [{"rate_hz": -1.0}, {"gone": 1}, {"rate_hz": "fast"}])
def test_value_that_no_longer_fits_is_left_out(values):
    node, parameters, logged = next_life(Memory({"/sensor": {"values": values, "set": [*values], "times": 1}}))
    assert node.parameters == SensorParameters()
    assert {source for _, source in parameters.values()} == {"default"}
    (line,) = logged
    assert (line.node, line.level) == ("/sensor", "warning")
    assert next(iter(values)) in line.values["reason"]


def test_raising_constructor_starts_with_launch_file_values():
    class Fragile(Sensor):
        def __init__(self, *arguments, **values):
            super().__init__(*arguments, **values)
            if self.parameters.rate_hz == 7:
                raise RuntimeError("not seven")

    values = {"rate_hz": 7.0}
    node, _, logged = next_life(Memory({"/fragile": {"values": values, "set": [*values], "times": 1}}), Fragile)
    assert node.parameters.rate_hz == 10
    assert "RuntimeError: not seven" in logged[0].values["reason"]


def test_each_restart_draws_new_random_numbers():
    drawn = {int(next_life(Memory(restarts={"/sensor": life}))[0].rng.integers(1 << 60)) for life in range(4)}
    assert len(drawn) == 4
