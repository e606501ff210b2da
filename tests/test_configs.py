"""Every launch file that comes with busflow is checked, and started on virtual time."""

from pathlib import Path

import pytest

from busflow.cli import main
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.testing import harness, virtual_time

FOLDER = Path(__file__).parents[1] / "configs"
APART = {"textbook.yaml": "assistant"}
"""Launch files with nodes of another distribution of this project, whose tests check them."""
CONFIGS = sorted(path for path in FOLDER.glob("*.yaml") if path.name not in APART)
WARNED = {"lab_fall.yaml": {"the robot has fallen"}}
"""The warnings of a launch file that shows what goes wrong."""
SLOW = ("humanoid", "lab_balance", "lab_fall")
"""Launch files of 31 joints, or of physics, whose minute takes seconds."""
each_config = pytest.mark.parametrize("config", CONFIGS, ids=lambda config: config.name)


def test_the_launch_files_are_found():
    assert FOLDER / "lab1.yaml" in CONFIGS


@each_config
def test_check_finds_nothing_even_when_strict(config, capsys):
    assert main(["check", str(config), "--strict"]) == 0
    assert capsys.readouterr().out == "no problems\n"


@pytest.mark.parametrize(
    "config",
    [pytest.param(each, marks=[pytest.mark.long] * each.stem.startswith(SLOW), id=each.name) for each in CONFIGS],
)
@virtual_time
async def test_it_runs_and_loses_nothing(config):
    """Every node stays up, no message is dropped, and no warning is logged but what the file is there to show."""
    async with harness(config) as lab:
        await lab.advance(20 if config.stem.startswith(SLOW) else 60)
    report = lab.graph.report()
    assert {node.state for node in report.nodes} == {"stopped"}
    assert sum(topic.published for topic in report.topics) > 0
    assert report.dropped == 0
    assert {record.event for record in lab.log if record.level != "info"} == WARNED.get(config.name, set())


@pytest.mark.parametrize(("config", "folder"), APART.items())
@pytest.mark.usefixtures("nothing_installed")
def test_missing_distribution_is_named_with_its_command(config, folder, capsys):
    assert main(["check", str(FOLDER / config)]) == 3
    assert f": pip install . ./{folder}" in capsys.readouterr().out


@each_config
def test_it_can_be_included_under_a_namespace(config, tmp_path, capsys):
    file = tmp_path / "two.yaml"
    file.write_text(f"include:\n  - {{file: {config}, namespace: left}}\n  - {{file: {config}, namespace: right}}\n")
    assert main(["check", str(file), "--strict"]) == 0
    assert capsys.readouterr().out == "no problems\n"


@virtual_time
async def test_lab1_runs_as_its_file_says():
    async with harness(FOLDER / "lab1.yaml", args={"rate_hz": 50}) as lab:
        await lab.advance(10)
        assert len(lab.received("imu/data", Imu)) == len(lab.received("joint_states", JointState)) == 500
        assert len(lab.received("balance_state")) == len(lab.received("stability_index")) == 500
    lines = {line.topic: line for line in lab.ledger}
    assert (lines["/imu/data"].depth, lines["/imu/data"].delivered) == (5, 500)
    assert (lines["/joint_states"].depth, lines["/joint_states"].delivered) == (10, 500)
    assert [record.event for record in lab.log] == ["All sensors operational"]


def test_lab1_has_a_camera_on_request(capsys):
    asked = ["--set", "nodes.sensor_publisher.parameters.camera_hz=30"]
    assert main(["graph", str(FOLDER / "lab1.yaml"), *asked]) == 0
    assert ["/camera/image_raw", "sensor_msgs/msg/Image"] in [
        line.split()[:2] for line in capsys.readouterr().out.splitlines()
    ]
