"""What a faulty or hostile neighbour may cost: a line in the log and a count."""

from pathlib import Path

import pytest

pytestmark = pytest.mark.long
FLOAT64 = "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a"


@pytest.fixture(scope="module")
def bad(stage):
    return stage.peer("enclave=/;")


@pytest.fixture(autouse=True)
def all_is_carried_afterwards(stage):
    """After each test a message of another neighbour still gets through."""
    yield
    other = stage.peer()
    other.do("advertise", topic="rt/command", kind="Float64", latched=True)
    before = len(stage.robot.lines)
    other.do("write", topic="rt/command", value=9.5)
    stage.robot.wait_for("command 9.5", after=before)
    assert stage.bridge.process.poll() is None
    assert stage.robot.process.poll() is None


def test_text_that_is_no_utf8_is_refused(stage, bad):
    bad.do("advertise", topic="rt/goal", kind="String", latched=True)
    bad.do("list_nodes", nodes=[{"name": "bad", "topics": ["rt/goal"]}])
    bad.do("write_bytes", topic="rt/goal", payload="00010000 04000000 ff fe fd 00".replace(" ", ""))
    assert "/goal" in stage.robot.wait_for("malformed")


LYING = {
    "absurd length": "00010000ffffffff61620000",
    "length of 256 MB": "000100000000001061620000",
    "no body": "00010000",
}


def test_length_that_lies_is_no_message(stage):
    others = stage.busflow("topic", "info", "goal").partition("Publisher count: ")[2].split()[0]
    liar = stage.peer()
    liar.do("advertise", topic="rt/goal", kind="String", latched=True)
    stage.until(f"Publisher count: {int(others) + 1}", "topic", "info", "goal")
    before = len(stage.robot.lines)
    good = ["0001000003000000" + text.encode().hex() + "0000" for text in ("a1", "z1")]
    liar.do("inject", topic="rt/goal", payloads=[good[0], *LYING.values(), good[1]])
    stage.robot.wait_for("goal z1", after=before)
    goals = [line.split("goal ")[1].split()[0] for line in stage.robot.lines[before:] if ": goal " in line]
    assert goals == ["a1", "z1"]
    liar.end()


def test_other_type_on_a_topic_is_logged(stage, bad):
    bad.do("advertise", topic="rt/camera", kind="Float64")
    bad.do("list_nodes", nodes=[{"name": "bad", "topics": ["rt/camera"]}])
    line = stage.bridge.wait_for("/camera")
    for each in ("/bad ", " std_msgs/msg/Float64, ", " sensor_msgs/msg/Image on /camera"):
        assert each in line


def test_other_definition_of_a_type_is_logged(stage, bad):
    bad.do("advertise", topic="rt/show", kind="Int64", data=f"typehash={FLOAT64};", latched=True)
    bad.do("list_nodes", nodes=[{"name": "bad", "topics": ["rt/show"]}])
    bad.do("write", topic="rt/show", value=5)
    assert " std_msgs/msg/Int64 on /show" in stage.bridge.wait_for("/show")


@pytest.mark.parametrize("topic", ["rt//a", "rt/1a", "rt/a/"])
def test_name_that_cannot_be_is_logged(stage, bad, topic):
    bad.do("advertise", topic=topic, kind="Float64")
    stage.bridge.wait_for(f"{topic} is no name of a topic")


def test_node_name_that_cannot_be_is_escaped(stage, bad):
    bad.do("list_nodes", nodes=[{"name": "a\x1b[31m"}])
    line = stage.bridge.wait_for("no namespace and name of a node")
    assert "\x1b" not in line


def test_absurd_user_data_costs_nothing(stage, bad):
    bad.do("advertise", topic="rt/absurd", kind="Float64", data="=;;typehash=RIHS01_zz;" * 100)
    bad.do("list_nodes", nodes=[{"name": "bad", "topics": ["rt/absurd"]}])
    stage.until("/absurd", "topic", "list")


def test_flood_leaves_other_topics_alone(stage, bad):
    bad.do("advertise", topic="rt/flood", kind="Int64", depth=1000)
    bad.do("advertise", topic="rt/count", kind="Int64", depth=1000)
    bad.do("list_nodes", nodes=[{"name": "bad", "topics": ["rt/flood", "rt/count"]}])
    stage.until("Publisher count: 1", "topic", "info", "count")
    bad.do("write", topic="rt/flood", value=0, count=20_000)
    bad.do("write", topic="rt/count", value=0, count=20_000)
    stage.robot.wait_for("count 19999")


def test_sockets_receive_from_this_machine_alone(stage):
    """Where Linux shows it: each socket of the bridge is bound to the loopback interface."""
    if not Path("/proc/self/net/udp").exists():
        pytest.skip("this system does not list sockets")
    import subprocess

    ss = subprocess.run(["ss", "-Hlunp"], capture_output=True, text=True, check=False)  # its rows name the process
    rows = [line.split()[3] for line in ss.stdout.splitlines() if f"pid={stage.bridge.process.pid}," in line]
    assert len(rows) >= 3
    assert all(row.startswith(("127.0.0.1:", "0.0.0.0%lo:")) for row in rows), rows
