"""`busflow service`: its output beside that of `ros2 service`, and calls of a node that fails or does not answer."""

import json
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from busflow.cli import main
from busflow.wire.client.client import join

Captured = pytest.CaptureFixture[str]
Said = Callable[[str], str]

LAMP = """
import asyncio

from busflow import Node, client, service
from busflow.msgs.std_srvs import SetBool, Trigger


class Lamp(Node):
    @service(SetBool, "~/switch")
    def switch(self, request: SetBool.Request) -> SetBool.Response:
        if not request.data:
            raise ValueError("it stays \\x1b[31mon")
        return SetBool.Response(success=True, message="it is \\x1b[31mon")

    @service(Trigger, "~/dim")
    def dim(self, request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response()

    @service(Trigger, "~/never")
    async def never(self, request: Trigger.Request) -> Trigger.Response:
        await asyncio.Event().wait()
        return Trigger.Response()

    nobody = client(Trigger, "nobody")

    async def run(self) -> None:
        self.log.info("works")
"""


@pytest.fixture(scope="module")
def room(stand: Callable[..., Any]) -> Any:
    """The place of a run of a lamp."""
    place, run = stand("room", "name: room\nplugins: [plugins]\nnodes:\n  lamp:\n    plugin: lamp\n", {"lamp": LAMP})
    run.wait_for("works")
    return place


@pytest.fixture
def lamp(room: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The running lamp, found by commands of this process."""
    room.look(monkeypatch)


def asked(capsys: Captured, *command: str) -> tuple[int, str, str]:
    code = main(["service", *command])
    out, err = capsys.readouterr()
    return code, out, err


@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize(
    ("command", "capture"),
    [("list", "58_service_list"), ("list -t", "59_service_list_t")],
)
def test_every_service_that_ros2_listed_is_listed(capsys: Captured, ros2_file: Said, command: str, capture: str):
    code, out, _ = asked(capsys, *command.split())
    wanted = [line for line in ros2_file(capture).splitlines() if "type_description" not in line]
    assert code == 0
    assert [line for line in out.splitlines() if line in wanted] == [line for line in wanted if "imu_publisher" in line]


@pytest.mark.usefixtures("lab")
def test_type_and_call_print_as_ros2(capsys: Captured, ros2_file: Said):
    assert asked(capsys, "type", "/imu_publisher/get_parameters") == (0, ros2_file("60_service_type"), "")
    call = ("call", "/imu_publisher/get_parameters", "rcl_interfaces/srv/GetParameters", "{names: [rate_hz]}")
    said = ros2_file("61_service_call").replace("double_value=20.0", "double_value=10.0")
    assert asked(capsys, *call) == (0, said, "")


@pytest.mark.usefixtures("lamp")
def test_a_service_is_listed_found_counted_and_described(capsys: Captured):
    assert asked(capsys, "list") == (0, "/lamp/dim\n/lamp/never\n/lamp/switch\n/nobody\n", "")
    assert asked(capsys, "list", "-c") == (0, "4\n", "")
    assert asked(capsys, "list", "-c", "--include-hidden-services") == (0, "6\n", "")
    assert asked(capsys, "find", "rcl_interfaces/GetLoggerLevels") == (0, "/lamp/get_logger_levels\n", "")
    assert asked(capsys, "find", "std_srvs/SetBool") == (0, "/lamp/switch\n", "")
    code, out, _ = asked(capsys, "info", "lamp/dim")
    assert code == 0
    assert out.splitlines()[:3] == ["Type: std_srvs/srv/Trigger", "Clients count: 0", "Services count: 1"]
    assert "server  /lamp  0 received" in out


@pytest.mark.usefixtures("lamp")
def test_echo_prints_requests_and_responses(capsys: Captured):
    command = [sys.executable, "-m", "busflow", "service", "echo", "lamp/switch", "std_srvs/SetBool", "-n", "3"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as echo, join() as peer:
        while not (topic := peer.graph().topics.get("/lamp/switch/_service_event")) or not topic.publishers:
            assert echo.poll() is None
        assert asked(capsys, "call", "lamp/switch", "std_srvs/SetBool", "{data: true}")[0] == 0
        assert asked(capsys, "call", "lamp/switch", "std_srvs/SetBool", "{data: false}")[0] == 1
        out, err = echo.communicate(timeout=60)
    assert (echo.returncode, err) == (0, "")
    request, response, failed, rest = out.split("---\n")
    number = int(request.partition("sequence_number: ")[2].split()[0])
    assert request.startswith("info:\n  event_type: REQUEST_RECEIVED\n  stamp:\n    sec: ")
    assert request.endswith(f"  sequence_number: {number}\nrequest: [{{data: true}}]\nresponse: []\n")
    assert response.startswith("info:\n  event_type: RESPONSE_SENT\n")
    assert response.endswith('request: []\nresponse: [{success: true, message: "it is \\x1b[31mon"}]\n')
    assert failed.endswith(f"  sequence_number: {number + 1}\nrequest: [{{data: false}}]\nresponse: []\n")
    assert rest == ""


@pytest.mark.usefixtures("lamp")
@pytest.mark.parametrize(
    ("arguments", "code", "expected"),
    [
        (["lamp/swich"], 4, "there is no service /lamp/swich; did you mean '/lamp/switch'?"),
        (["lamp/swich", "--wait", "1ms"], 4, "there is no service /lamp/swich; did you mean '/lamp/switch'?"),
        (["lamp/switch", "std_srvs/Trigger"], 2, "has the type std_srvs/srv/SetBool, not std_srvs/srv/Trigger"),
        (["lamp/get_logger_levels"], 4, "the calls of /lamp/get_logger_levels, which every node answers, are not pub"),
        (["lamp/dim", "--timeout", "0.05"], 1, "nothing to print came on /lamp/dim/_service_event for 0.05 s"),
    ],
)
def test_echo_that_cannot_be_says_why(capsys: Captured, arguments: list[str], code: int, expected: str):
    found, out, err = asked(capsys, "echo", *arguments)
    assert (found, out, expected in err) == (code, "", True)


@pytest.mark.usefixtures("lamp")
def test_response_is_shown_and_escaped(capsys: Captured):
    code, out, _ = asked(capsys, "call", "lamp/switch", "std_srvs/SetBool", "{data: true}")
    assert code == 0
    assert out.splitlines() == [
        "requester: making request: std_srvs.srv.SetBool_Request(data=True)",
        "",
        "response:",
        r"std_srvs.srv.SetBool_Response(success=True, message='it is \x1b[31mon')",
        "",
    ]
    _, out, _ = asked(capsys, "call", "lamp/switch", "std_srvs/SetBool", "{data: true}", "--json")
    answer = json.loads(out)
    assert (answer["version"], answer["service"], answer["response"]["success"]) == (1, "/lamp/switch", True)


@pytest.mark.usefixtures("lamp")
@pytest.mark.parametrize(
    ("command", "code", "reason"),
    [
        ("call lamp/switch std_srvs/SetBool {data:\\ false}", 1, r"ValueError: it stays \x1b[31mon"),
        ("call lamp/never std_srvs/Trigger --timeout 0.2", 1, "did not answer within 0.2 s"),
        ("call lamp/never std_srvs/Trigger --timeout 200ms", 1, "did not answer within 0.2 s"),
        ("call lamp/never std_srvs/Trigger --timeout soon", 2, "--timeout"),
        ("call lamp/never std_srvs/Trigger --timeout 0", 2, "--timeout"),
        ("call nobody std_srvs/Trigger", 1, "/nobody has clients only, no server"),
        ("call lamp/swich std_srvs/SetBool", 4, "did you mean '/lamp/switch'?"),
        ("call lamp/switch std_srvs/Trigger", 2, "has the type std_srvs/srv/SetBool, not std_srvs/srv/Trigger"),
        ("call lamp/switch std_srvs/SetBool {dat:\\ true}", 2, "did you mean 'data'?"),
        ("find std_srvs/SetBol", 4, "did you mean 'std_srvs/srv/SetBool'?"),
    ],
)
def test_errors_are_reported_at_once(capsys: Captured, command: str, code: int, reason: str):
    words = [word.replace("\\ ", " ") for word in command.replace("\\ ", "\x00").split()]
    found, _, err = asked(capsys, *[word.replace("\x00", " ") for word in words])
    assert (found, reason in err) == (code, True), err
