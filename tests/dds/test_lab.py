"""The lab with one half on busflow and the other a program of DDS alone, joined by two lines of a launch file."""

from pathlib import Path

import pytest

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]
LAB = f"""
plugins: [{ROOT}/plugins]
network: {{ros2: {{transport: dds}}}}
nodes:
  HALF: {{plugin: HALF}}
"""


@pytest.fixture
def lab(stage_of, tmp_path):
    """Starts a half of the lab on busflow and the other in DDS, and returns both."""

    def start(half, other):
        file = tmp_path / "half.yaml"
        file.write_text(LAB.replace("HALF", half))
        stage = stage_of("-m", "busflow", "run", str(file), "--set", "network.ros2.domain=DOMAIN", "--run", "robot")
        stage.robot.wait_for("see each other")
        return stage, stage.start_alone("lab.py", str(stage.domain), other)

    return start


def test_processor_in_dds_works_on_sensors_of_busflow(lab):
    stage, processor = lab("sensor_publisher", "processor")
    processor.wait_for("joints 10")
    assert "data: 0." in stage.until("data: 0.", "topic", "echo", "--once", "balance_state")


def test_processor_of_busflow_works_on_sensors_in_dds(lab):
    stage, sensors = lab("sensor_processor", "sensors")
    stage.robot.wait_for("All sensors operational")
    sensors.wait_for("balance 0.25")
