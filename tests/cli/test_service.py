"""`busflow service`: its output beside that of `ros2 service`, and calls of a node that fails or does not answer."""

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from busflow.cli import main
from busflow.wire.client.client import join
from tests.cli.conftest import LABS, Shell

Said = Callable[[str], str]


@pytest.fixture(scope="module")
def room(stand: Callable[..., Any]) -> Any:
    """The place of a run of a lamp."""
    place, run = stand(LABS / "lamp.yaml")
    run.wait_for("works")
    return place


@pytest.fixture
def lamp(room: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The running lamp, found by commands of this process."""
    room.look(monkeypatch)


@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize(
    ("command", "capture"),
    [("list", "58_service_list"), ("list -t", "59_service_list_t")],
)
def test_every_service_that_ros2_listed_is_listed(capsys, ros2_file: Said, command: str, capture: str):
    assert main(["service", *command.split()]) == 0
    wanted = [line for line in ros2_file(capture).splitlines() if "type_description" not in line]
    found = [line for line in capsys.readouterr().out.splitlines() if line in wanted]
    assert found == [line for line in wanted if "imu_publisher" in line]


@pytest.mark.usefixtures("lab")
def test_type_and_call_print_as_ros2(capsys, ros2_file: Said):
    assert main(["service", "type", "/imu_publisher/get_parameters"]) == 0
    assert capsys.readouterr() == (ros2_file("60_service_type"), "")
    call = ("call", "/imu_publisher/get_parameters", "rcl_interfaces/srv/GetParameters", "{names: [rate_hz]}")
    said = ros2_file("61_service_call").replace("double_value=20.0", "double_value=10.0")
    assert main(["service", *call]) == 0
    assert capsys.readouterr() == (said, "")


@pytest.mark.usefixtures("lamp")
@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("list", 0),
        ("list -c", 0),
        ("list -c --include-hidden-services", 0),
        ("find rcl_interfaces/GetLoggerLevels", 0),
        ("find std_srvs/SetBool", 0),
        ("find std_srvs/SetBol", 4),
        ("info lamp/dim", 0),
        ("echo lamp/swich", 4),
        ("echo lamp/swich --wait 1ms", 4),
        ("echo lamp/switch std_srvs/Trigger", 2),
        ("echo lamp/get_logger_levels", 4),
        ("echo lamp/dim --timeout 0.05", 1),
        ("call lamp/switch std_srvs/SetBool '{data: true}'", 0),
        ("call lamp/switch std_srvs/SetBool '{data: false}'", 1),
        ("call lamp/switch std_srvs/SetBool '{dat: true}'", 2),
        ("call lamp/switch std_srvs/Trigger", 2),
        ("call lamp/never std_srvs/Trigger --timeout 0.2", 1),
        ("call lamp/never std_srvs/Trigger --timeout 200ms", 1),
        ("call lamp/never std_srvs/Trigger --timeout soon", 2),
        ("call lamp/never std_srvs/Trigger --timeout 0", 2),
        ("call lamp/swich std_srvs/SetBool", 4),
        ("call nobody std_srvs/Trigger", 1),
    ],
)
def test_output(shell: Shell, line: str, code: int):
    assert shell(f"service {line}", mask={r"(\d+ received).*": r"\1 …", r"(?m)^waiting: .*\n": ""}) == code


@pytest.mark.usefixtures("lamp")
def test_call_is_data_too(shell: Shell):
    answer = shell.data("service call lamp/switch std_srvs/SetBool", "{data: true}")
    assert (answer["version"], answer["service"], answer["response"]["success"]) == (1, "/lamp/switch", True)


@pytest.mark.usefixtures("lamp")
def test_data_is_whole(shell: Shell):
    assert shell.data("service call lamp/dim std_srvs/Trigger")["response"]["message"] == "dim " * 100


@pytest.mark.usefixtures("lamp")
def test_echo_prints_requests_and_responses(shell: Shell):
    command = [sys.executable, "-m", "busflow", "service", "echo", "lamp/switch", "std_srvs/SetBool", "-n", "3"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as echo, join() as peer:
        while not (topic := peer.graph().topics.get("/lamp/switch/_service_event")) or not topic.publishers:
            assert echo.poll() is None
        for data, code in (("true", 0), ("false", 1)):
            assert main(["service", "call", "lamp/switch", "std_srvs/SetBool", f"{{data: {data}}}"]) == code
        out, err = echo.communicate(timeout=60)
    assert (echo.returncode, err) == (0, "")
    numbers = [int(part.partition("sequence_number: ")[2].split()[0]) for part in out.split("---\n")[:-1]]
    assert numbers == [numbers[0], numbers[0], numbers[0] + 1]
    shell.note(out, mask={r"(sec|nanosec|sequence_number): \d+": r"\1: #", r"(?m)^(  client_gid:).*": r"\1 #"})
