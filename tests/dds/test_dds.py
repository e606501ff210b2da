"""Tests of the bridge as a whole, between a run and a program of DDS alone.

They are those of `bridge.py`, `topics.py`, `services.py`, `calls.py`, `shown.py`, `neighbours.py`, `outlet.py`,
`inlet.py` and `participant.py`. Those of `process.py` are in `test_extension.py`, those of `known_types.py` in
`test_idl.py`.
"""

from collections.abc import Iterator

import pytest

from tests.dds.conftest import SCRIPT, Stage, staged

FLOAT64 = "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a"


@pytest.fixture(scope="module")
def stage() -> Iterator[Stage]:
    """A run and its bridge, which is in this process."""
    with staged("-c", SCRIPT) as found, pytest.MonkeyPatch.context() as patch:
        found.robot.wait_for("ready")
        for name, value in found.environment.items():
            patch.setenv(name, value)
        found.bridge = found.open_bridge_here()
        yield found


@pytest.fixture(scope="module")
def bare(stage):
    return stage.peer()


def test_publisher_has_ros2s_names_in_dds(bare):
    found = bare.said(found="writer", topic="rt/speed")
    assert found["type"] == "std_msgs::msg::dds_::Float64_"
    assert found["data"] == f"typehash={FLOAT64};"
    assert (found["latched"], found["reliable"]) == (False, True)


def test_message_of_the_run_reaches_dds(bare):
    bare.do("read", topic="rt/speed", kind="Float64")
    bare.said(got="rt/speed", value=1.5)


def test_message_from_dds_reaches_the_run(stage, bare):
    bare.do("advertise", topic="rt/command", kind="Float64", latched=True)
    bare.do("write", topic="rt/command", value=2.25)
    stage.robot.wait_for("command 2.25")


def test_late_reader_in_dds_gets_what_is_kept(bare):
    bare.do("read", topic="rt/map_name", kind="String", latched=True)
    bare.said(got="rt/map_name", value="kitchen")
    bare.said(got="rt/map_name", value="attic")
    assert not [line for line in bare.lines if "cellar" in line]


def test_run_gets_what_a_writer_keeps(stage, bare):
    bare.do("advertise", topic="rt/goal", kind="String", latched=True, depth=1)
    bare.do("write", topic="rt/goal", value="bridge")
    stage.robot.wait_for("goal bridge")


def test_no_message_is_lost_or_doubled(stage, bare):
    bare.do("advertise", topic="rt/count", kind="Int64", latched=True, depth=1000)
    bare.do("write", topic="rt/count", value=0, count=300)
    stage.robot.wait_for("count 299")
    assert [line.split(": count ")[1].split()[0] for line in stage.robot.lines if ": count " in line] == [
        "99",
        "199",
        "299",
    ]


def test_incompatible_qos_is_logged_with_its_reason(stage, bare):
    bare.do("read", topic="rt/speed", kind="Float64", latched=True)
    line = stage.bridge.wait_for("does not receive /driver on /speed")
    assert "transient" in line.lower()


def test_nodes_of_the_run_are_listed_in_dds(bare):
    bare.do("read_nodes")
    written = bare.said(found="writer", topic="rt/speed")["gid"]
    read = bare.said(found="reader", topic="rt/command")["gid"]
    asked = bare.said(found="reader", topic="rq/addRequest")["gid"]
    after = 0
    while True:
        node = bare.said(node="driver", namespace="/", after=after)
        if written in node["writers"] and {read, asked} <= set(node["readers"]):
            return
        after = bare.mark()


def test_neighbours_nodes_are_listed_in_the_run(stage):
    peer = stage.peer("enclave=/;")
    peer.do("advertise", topic="rt/command", kind="Float64", data=f"typehash={FLOAT64};")
    peer.do("list_nodes", nodes=[{"name": "joystick", "namespace": "/left", "topics": ["rt/command"]}])
    stage.until("/left/joystick", "node", "list")
    assert "Node name: joystick" in stage.until("joystick", "topic", "info", "-v", "command")
    peer.do("write", topic="rt/command", value=3.5)
    stage.robot.wait_for("command 3.5")


def test_neighbour_calls_a_server_of_the_run(bare):
    asked = bare.said(found="reader", topic="rq/addRequest")
    assert asked["type"] == "example_interfaces::srv::dds_::AddTwoInts_Request_"
    assert asked["data"].startswith("serviceid= 1.")
    bare.do("client", name="/add")
    for number in (1, 2):
        bare.do("call", name="/add", a=20, b=number, seq=number)
        assert bare.said(answered="/add", seq=number)["sum"] == 20 + number
        assert bare.said(answered="/add", seq=number)["guid"] == 77


def test_run_calls_a_server_of_a_neighbour(stage, bare):
    bare.do("serve", name="/other_add")
    bare.do("advertise", topic="rt/ask_other", kind="Int64", latched=True)
    stage.until("/other_add", "service", "list")
    bare.do("write", topic="rt/ask_other", value=41)
    bare.said(asked="/other_add", a=41, b=1)
    stage.robot.wait_for("answer 42")


def test_writer_in_no_list_is_received(stage):
    """ROS 2 lists nodes; before Iron in another form, which is not read."""
    peer = stage.peer("enclave=/;")
    peer.do("advertise", topic="rt/command", kind="Float64", latched=True)
    peer.do("write", topic="rt/command", value=4.5)
    stage.robot.wait_for("command 4.5")
    assert "_NODE_NAME_UNKNOWN_" in stage.busflow("topic", "info", "-v", "command")
