# pyright: strict, reportUnnecessaryTypeIgnoreComment=true
"""What a strict type checker sees of a test on virtual time: read, never run; each ignore must be needed."""

from typing import Any, assert_type

from busflow import Node
from busflow.msgs.std_msgs import Float64
from busflow.testing import Harness, explore, harness, virtual_time
from plugins.sensor_processor import SensorProcessor


@virtual_time
async def plain(number: int) -> str:
    async with harness("configs/lab1.yaml", SensorProcessor, SensorProcessor(max_joint_angle=1)) as lab:
        assert_type(lab, Harness)
        assert_type(lab.node(SensorProcessor), SensorProcessor)
        assert_type(lab.node(SensorProcessor).status, str)
        assert_type(lab.node("sensor_processor"), Node)
        assert_type(await lab.wait_for("balance_state", Float64, timeout=1), Float64)
        assert_type(lab.received("balance_state", Float64), list[Float64])
        assert_type(lab.received("balance_state"), list[Any])
        assert_type(lab.ledger.dropped, int)
        str(lab.node(SensorProcessor).nothing)  # type: ignore[attr-defined]  # the node is typed
        lab.publish("balance_state", 1.0)  # type: ignore[arg-type]  # a topic carries messages
    return str(number)


@virtual_time(seed=1, horizon_s=5)
async def with_options(number: int) -> str:
    return str(number)


@explore
async def explored(number: int) -> None:
    assert number


@explore(schedules=5)
async def explored_often(number: int) -> None:
    assert number


def called() -> None:
    assert_type(plain(1), str)
    assert_type(with_options(1), str)
    assert_type(explored(1), None)
    assert_type(explored_often(1), None)
    plain("1")  # type: ignore[arg-type]  # a decorated test keeps its parameters
