"""A run's parameters, as a viewer reads, sets and follows them."""

from typing import Any

import pytest

from busflow import Node, Parameters
from busflow_ui.foxglove.parameters import RunParameters
from tests.golden import Golden

pytestmark = pytest.mark.asyncio


class GainParameters(Parameters):
    gain: float = 2.0
    steps: int = 3
    limits: tuple[float, ...] = (1.0, 2.0)


class Gain(Node):
    parameters: GainParameters


async def test_each_parameter_has_name_value_and_type(looked_at: Any):
    async with looked_at(Gain) as looked:
        parameters = RunParameters(looked.peer)
        rows = await looked.ask(parameters.get)
        asked = await looked.ask(parameters.get, ["/gain.steps", "/gain.absent"])
    assert rows == [
        {"name": "/gain.gain", "value": 2.0, "type": "float64"},
        {"name": "/gain.limits", "value": [1.0, 2.0], "type": "float64_array"},
        {"name": "/gain.steps", "value": 3},
    ]
    assert asked == [{"name": "/gain.steps", "value": 3}]


async def test_refused_value_leaves_the_others_unset(looked_at: Any):
    async with looked_at(Gain) as looked:
        parameters = RunParameters(looked.peer)
        assert await looked.ask(parameters.set, {"/gain.gain": 4.0, "/gain.steps": 5}) == []
        assert looked.graph.node(Gain).parameters.gain == 4.0
        (reason,) = await looked.ask(parameters.set, {"/gain.gain": 6.0, "/gain.steps": "many"})
        assert looked.graph.node(Gain).parameters.gain == 4.0
    assert reason.startswith("/gain: steps must be ")


async def test_unknown_and_removed_parameters_are_refused(looked_at: Any, golden: Golden):
    async with looked_at(Gain) as looked:
        reasons = await looked.ask(RunParameters(looked.peer).set, {"/gain.gian": 1.0, "/gain.steps": None})
    golden("\n".join(reasons))


async def test_changes_are_those_since_the_last_call(looked_at: Any):
    async with looked_at(Gain) as looked:
        parameters = RunParameters(looked.peer)
        looked.graph.set_parameters("gain", {"steps": 4})
        assert await looked.ask(parameters.changes) == [], "the first call begins"
        looked.graph.set_parameters("gain", {"steps": 5})
        assert await looked.ask(parameters.changes) == [{"name": "/gain.steps", "value": 5}]
        assert await looked.ask(parameters.changes) == []
        looked.graph.set_parameters("gain", {"steps": 6})
        parameters.forget()
        assert await looked.ask(parameters.changes) == []
