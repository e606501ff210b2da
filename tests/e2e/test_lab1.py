"""The lab steered from another terminal while it runs: its noise is turned, and its simulation begins anew."""

from pathlib import Path

import pytest

from tests.processes.conftest import project, start

__all__ = ["project", "start"]

pytestmark = pytest.mark.e2e

LAB = f"""
name: quiet
include: {Path(__file__).parents[2] / "configs/lab1.yaml"}
nodes:
  sensor_publisher: {{parameters: {{noise: {{imu: 0.0}}}}}}
  witness: {{plugin: witness}}
"""
NOISE = ("sensor_publisher", "noise.imu")


def test_commands_of_another_terminal_act_at_once(start):
    run = start(LAB)
    run.wait_for('"balance"', '"after": "start", "steady": true')
    assert run.busflow("param", "set", *NOISE, "0.5") == "Set parameter successful\n"
    run.wait_for('"balance"', '"after": "noise.imu = 0.5", "steady": false')
    run.busflow("param", "set", *NOISE, "11", expect=1)
    assert run.busflow("param", "get", *NOISE) == "Double value is: 0.5\n"
    assert "success=True" in run.busflow("service", "call", "sensor_publisher/reset", "std_srvs/srv/Trigger")
    run.wait_for('"/sensor_publisher"', '"after_s"')
    assert run.end() == 130
