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


def test_lines_of_stdin_arrive_until_a_bad_one():
    command = [sys.executable, "-m", "busflow", "topic", "pub", "--stdin", "cmd", FLOAT]
    text = '{"data": 1.5}\n\n{data: 2.5}\n'
    with join() as peer, peer.listen(peer.graph().topic("commanded")) as listener:
        for lines in (text, f"{text}{{data: high}}\n{{data: 4.5}}\n"):
            done = subprocess.run([*command, "-r", "200"], input=lines, capture_output=True, text=True, timeout=60)
            arrived = [listener.get(60) for _ in range(2)]
            assert [peer.type(FLOAT).decode(each.payload)["data"] for each in arrived if each] == [1.5, 2.5]
            assert done.stdout.startswith("publisher: beginning loop\npublishing #1: std_msgs.msg.Float64(data=1.5)")
            assert done.returncode == (2 if "high" in lines else 0)
        assert listener.get(0) is None
    assert done.stderr.startswith(
        "standard input:4:8: error: std_msgs/msg/Float64: data: 'high' is not a valid float64"
    )


def test_as_often_and_as_fast_as_asked_for(capsys: Captured):
    assert main(["topic", "pub", "-t", "5", "-r", "200", "-p", "2", "cmd", FLOAT, "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["count"] for line in lines] == [2, 4]
    assert lines[0] == {"version": 1, "topic": "/cmd", "count": 2, "message": {"data": 0.0}}


def test_unused_builtin_type_can_be_published(capsys: Captured):
    values = "{header: auto, position: [1, 2]}"
    assert main(["topic", "pub", "-t", "1", "-w", "0", "x", "sensor_msgs/msg/JointState", values]) == 0
    out, err = capsys.readouterr()
    assert "sensor_msgs.msg.JointState(header=std_msgs.msg.Header(stamp=builtin_interfaces.msg.Time(sec=1" in out
    assert "position=[1.0, 2.0]" in out
    assert err.startswith("warning: /x has no subscription; ")


def test_a_type_that_only_the_run_knows(capsys: Captured):
    assert main(["topic", "pub", "-t", "1", "-w", "0", "note", "odd/msg/Note", "{text: hi}"]) == 0
    assert "publishing #1: {'text': 'hi'}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "code", "expected"),
    [
        (["cmd", FLOAT, "{data: 1}", "--stdin"], 2, "--stdin reads the values: leave VALUES out"),
        (["cmd", FLOAT, "{data: oops}"], 2, "data: 'oops' is not a valid float64\n  {data: oops}\n         ^^^^\n"),
        (["cmd", FLOAT, "{value: 1.0}"], 2, "has no field 'value'; known: data"),
        (["cmd", FLOAT, "{data: 1.0"], 2, "this bracket is never closed"),
        (["cmd", FLOAT, "1.0"], 2, "fix: write data: 1.0"),
        (["cmd", "std_msgs/msg/String", "{data: a}"], 2, "/cmd has the type std_msgs/msg/Float64, not"),
        (["cmd", "{data: 1}"], 2, "fix: write the type before it; busflow topic type NAME shows the type"),
        (["cmd", "std_msgs/msg/Flot64"], 2, "did you mean 'std_msgs/msg/Float64'?"),
        (["cmd", "Imu"], 2, "no type 'Imu'; did you mean 'sensor_msgs/msg/Imu'?"),
        (["cmd", "std_srvs/srv/Trigger"], 2, "std_srvs/srv/Trigger is a service"),
        (["1cmd", FLOAT], 2, "starts with a digit"),
        (["cmd", FLOAT, "-r", "1e-320"], 2, "1e-320 is not in the range"),
        (["cmd", FLOAT, "--qos-depth", "9999999999"], 2, "9999999999 is not in the range"),
        (["cmd", FLOAT, "-1", "-t", "2"], 2, "exclude each other"),
    ],
)
def test_invalid_message_is_refused_before_publishing(capsys: Captured, arguments: list[str], code: int, expected: str):
    assert main(["topic", "pub", *arguments]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert expected in err


def test_it_waits_for_a_subscription_until_ctrl_c():
    command = [sys.executable, "-m", "busflow", "topic", "pub", "--once", "nobody", FLOAT]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as it:
        assert it.stdout is not None
        assert it.stdout.readline() == "Waiting for at least 1 matching subscription(s)...\n"
        it.send_signal(signal.SIGINT)
        _, err = it.communicate(timeout=60)
    assert it.returncode == 130
    warning, advice = err.splitlines()
    assert warning.startswith("warning: /nobody has no subscription; ")
    assert advice.endswith("-w 0")


def test_it_waits_no_longer_than_asked_for(capsys: Captured):
    assert main(["topic", "pub", "--once", "--max-wait-time-secs", "0.01", "nobody", FLOAT]) == 1
    out, err = capsys.readouterr()
    assert "publishing" not in out
    assert err.splitlines()[-1] == "error: /nobody did not have 1 subscription within 0.01 s"


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


def test_insufficient_qos_is_warned_of(capsys: Captured):
    assert main(["topic", "pub", "-t", "1", "-w", "0", "--qos-reliability", "best_effort", "cmd", FLOAT]) == 0
    why = "reliability: best_effort is offered, reliable is requested"
    assert capsys.readouterr().err == f"warning: /odds does not receive /cmd: {why}\n"


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
