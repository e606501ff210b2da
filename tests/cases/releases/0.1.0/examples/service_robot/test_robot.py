"""The robot patrols within its limits, and stands when what commands it is gone."""

from pathlib import Path

import pytest

from busflow.errors import InvalidParameter
from busflow.msgs.geometry_msgs import Twist
from busflow.msgs.std_srvs import SetBool
from busflow.testing import harness, virtual_time

FILE = Path(__file__).parent / "robot.yaml"


def speeds(lab, last):
    return [each.linear.x for each in lab.received("velocity", Twist)[-last:]]


@virtual_time
async def test_it_goes_to_and_fro():
    async with harness(FILE, args={"speed": 0.4}) as lab:
        await lab.advance(60)
        assert (min(speeds(lab, 1000)), max(speeds(lab, 1000))) == (pytest.approx(-0.4), pytest.approx(0.4))


@virtual_time
async def test_speed_never_passes_the_limit():
    async with harness(FILE, args={"speed": 2.0}) as lab:
        await lab.advance(20)
        lab.set_parameters("drive", max_speed=0.3)
        await lab.advance(20)
        assert max(map(abs, speeds(lab, 200))) == pytest.approx(0.3)


@virtual_time
async def test_it_stands_without_commands():
    async with harness(FILE) as lab:
        await lab.advance(3)
        lab.drop("cmd_vel")
        await lab.advance(3)
        assert speeds(lab, 10) == [0.0] * 10
        lab.heal("cmd_vel")
        await lab.advance(3)
        assert any(speeds(lab, 20))


@virtual_time
async def test_it_stands_with_its_motors_off():
    async with harness(FILE) as lab:
        await lab.advance(3)
        answer = await lab.call(SetBool, "motors", SetBool.Request(data=False))
        assert (answer.success, answer.message) == (True, "off")
        await lab.advance(3)
        assert speeds(lab, 10) == [0.0] * 10


@virtual_time
async def test_a_speed_it_cannot_stop_from_is_refused():
    async with harness(FILE) as lab:
        with pytest.raises(InvalidParameter, match="has to stop within four seconds"):
            lab.set_parameters("drive", max_acceleration=0.1)
