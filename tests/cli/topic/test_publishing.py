"""`busflow topic pub`: publishes messages, and refuses invalid ones beforehand."""

import json
import signal
import subprocess
import sys
from collections.abc import Callable

import pytest
import zenoh

from busflow import QoS
from busflow.cli import main
from busflow.wire.client.client import join
from busflow.wire.zenoh.keys import GRAPH, Token, TokenKind, topic_key
from busflow.wire.zenoh.qos_text import to_text
from tests.cli.conftest import Shell

Captured = pytest.CaptureFixture[str]

pytestmark = pytest.mark.usefixtures("odds")

FLOAT = "std_msgs/msg/Float64"


def test_output_is_that_of_ros2(capsys: Captured, ros2_said: Callable[[str], str]):
    assert main(["topic", "pub", "--once", "/cmd", FLOAT, "{data: 1.5}"]) == 0
    assert capsys.readouterr() == (ros2_said("202_pub_once_with_listener"), "")


def test_published_messages_arrive():
    with join() as peer, peer.listen(peer.graph().topic("commanded")) as listener:
        arrived: list[float] = []
        for number in range(5):
            assert main(["topic", "pub", "--once", "cmd", "std_msgs/Float64", f"data: {number}.5"]) == 0
        while len(arrived) < 5 and (received := listener.get(60)) is not None:
            arrived.append(peer.type(FLOAT).decode(received.payload)["data"])
    assert arrived == [0.5, 1.5, 2.5, 3.5, 4.5]


def test_lines_of_stdin_arrive_until_a_bad_one(shell: Shell):
    command = [sys.executable, "-m", "busflow", "topic", "pub", "--stdin", "cmd", FLOAT]
    text = '{"data": 1.5}\n\n{data: 2.5}\n'
    with join() as peer, peer.listen(peer.graph().topic("commanded")) as listener:
        for lines in (text, f"{text}{{data: high}}\n{{data: 4.5}}\n"):
            done = subprocess.run([*command, "-r", "200"], input=lines, capture_output=True, text=True, timeout=60)
            arrived = [listener.get(60) for _ in range(2)]
            assert [peer.type(FLOAT).decode(each.payload)["data"] for each in arrived if each] == [1.5, 2.5]
            assert done.stdout.splitlines()[1].endswith("#1: std_msgs.msg.Float64(data=1.5)")
            assert done.returncode == (2 if "high" in lines else 0)
        assert listener.get(0) is None
    shell.note(done.stderr)


def test_as_often_and_as_fast_as_asked_for(shell: Shell):
    lines = [json.loads(line) for line in shell.text(f"topic pub -t 5 -r 200 -p 2 cmd {FLOAT} --json").splitlines()]
    assert [line["count"] for line in lines] == [2, 4]
    assert lines[0] == {"version": 1, "topic": "/cmd", "count": 2, "message": {"data": 0.0}}


def test_data_is_whole(shell: Shell):
    (line,) = shell.text(f"topic pub -t 1 -w 0 words std_msgs/msg/String '{{data: {'x' * 300}}}' --json").splitlines()
    assert json.loads(line)["message"] == {"data": "x" * 300}


UNKNOWN = {"; known: .*|; did you mean '/.*": "; …", r"sec=\d+": "sec=#", r"(?m)^(\$ .*)": r"\1"}


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("-t 1 -w 0 x sensor_msgs/msg/JointState '{header: auto, position: [1, 2]}'", 0),
        ("-t 1 -w 0 note odd/msg/Note '{text: hi}'", 0),  # a type that only the run knows
        ("-t 1 -w 0 --qos-reliability best_effort cmd std_msgs/msg/Float64", 0),
        ("--once --max-wait-time-secs 0.01 nobody std_msgs/msg/Float64", 1),
        ("cmd std_msgs/msg/Float64 '{data: 1}' --stdin", 2),
        ("cmd std_msgs/msg/Float64 '{data: oops}'", 2),
        ("cmd std_msgs/msg/Float64 '{value: 1.0}'", 2),
        ("cmd std_msgs/msg/Float64 '{data: 1.0'", 2),
        ("cmd std_msgs/msg/Float64 1.0", 2),
        ("cmd std_msgs/msg/String '{data: a}'", 2),
        ("cmd '{data: 1}'", 2),
        ("cmd std_msgs/msg/Flot64", 2),
        ("cmd Imu", 2),
        ("cmd std_srvs/srv/Trigger", 2),
        ("1cmd std_msgs/msg/Float64", 2),
        ("cmd std_msgs/msg/Float64 -r 1e-320", 2),
        ("cmd std_msgs/msg/Float64 --qos-depth 9999999999", 2),
        ("cmd std_msgs/msg/Float64 -1 -t 2", 2),
    ],
)
def test_output(shell: Shell, line: str, code: int):
    assert shell(f"topic pub {line}", mask=UNKNOWN) == code
    assert code != 2 or shell.out == "", "an invalid message is refused before any is published"


def test_it_waits_for_a_subscription_until_ctrl_c(shell: Shell):
    command = [sys.executable, "-m", "busflow", "topic", "pub", "--once", "nobody", FLOAT]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as it:
        assert it.stdout is not None
        shell.note(it.stdout.readline())
        it.send_signal(signal.SIGINT)
        _, err = it.communicate(timeout=60)
    assert it.returncode == 130
    shell.note(err, mask=UNKNOWN)


def test_offered_qos_is_visible_in_the_graph():
    qos = ["--qos-depth", "3", "--qos-reliability", "best_effort", "--qos-durability", "transient_local"]
    command = [sys.executable, "-m", "busflow", "topic", "pub", "-w", "0", "-r", "1", *qos, "offered", FLOAT]
    with join() as peer, subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as it:
        assert it.stdout is not None
        assert it.stdout.readline() == "publisher: beginning loop\n"
        (offer,) = [each.qos for each in peer.graph().topic("offered").publishers]
        it.send_signal(signal.SIGINT)
        it.communicate(timeout=60)
    assert (offer.depth, offer.reliability, offer.durability) == (3, "best_effort", "transient_local")


def test_a_strict_subscription_receives_what_is_published(capsys: Captured):
    with join() as peer, peer.listen(peer.graph().topic("commanded")) as listener:
        assert main(["topic", "pub", "--once", "strict", FLOAT, "{data: 7.5}"]) == 0
        received = listener.get(60)
        assert received is not None
        assert peer.type(FLOAT).decode(received.payload) == {"data": 7.5}
    assert capsys.readouterr().err == ""


def test_the_offer_follows_subscriptions_that_come():
    command = [sys.executable, "-m", "busflow", "topic", "pub", "--once", "later", FLOAT]
    with join() as peer, subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as it:
        assert it.stdout is not None
        assert it.stdout.readline().startswith("Waiting for")
        type_, zid = peer.type(FLOAT), str(peer.session.info.zid())
        end = ("/later", type_.name, type_.type_hash, to_text(QoS(deadline=5.0)))
        token = Token(zid, 0, 1, TokenKind.SUBSCRIPTION, "/", "strict", *end)
        offers: list[str] = []
        seen = zenoh.handlers.Callback(lambda sample: offers.append(Token.parse(str(sample.key_expr)).qos))
        key = topic_key("/later", type_.name, type_.type_hash)
        with (
            peer.session.liveliness().declare_subscriber(f"{GRAPH}/*/*/*/*/{TokenKind.PUBLISHER}/**", seen),
            peer.session.declare_subscriber(key, arrived := zenoh.handlers.FifoChannel(5)),
            peer.session.liveliness().declare_token(str(token)),
        ):
            assert it.wait(60) == 0
        del arrived
    assert ":1:,10:5,0:,:,," in offers
