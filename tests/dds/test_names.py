"""The tests of `names`. The expected bytes are those that rmw_cyclonedds 2.2 and rmw_dds_common 3.2 write."""

import pytest

from busflow.dds.names import DdsName, NameUse, read_user_data, service_end_id, type_of, user_data
from busflow.errors import MalformedMessage


@pytest.mark.parametrize(
    ("use", "name", "in_dds"),
    [
        (NameUse.TOPIC, "/imu/data", "rt/imu/data"),
        (NameUse.REQUEST, "/add_two_ints", "rq/add_two_intsRequest"),
        (NameUse.REPLY, "/left/arm/get_parameters", "rr/left/arm/get_parametersReply"),
        (NameUse.TOPIC, "/move/_action/feedback", "rt/move/_action/feedback"),
    ],
)
def test_name_is_ros2s_in_both_directions(use, name, in_dds):
    assert str(DdsName(use, name)) == in_dds
    assert DdsName.parse(in_dds) == DdsName(use, name)


@pytest.mark.parametrize("text", ["ros_discovery_info", "imu", "DCPSTopic", "rs/x", "rq/x", "rr/xRequest", "rt"])
def test_other_names_are_not_ros2s(text):
    assert DdsName.parse(text) is None


@pytest.mark.parametrize("text", ["rt/", "rt/a b", "rt/*", "rt/1", "rt//a", "rt/a/", "rq/Request", "rt/\u202e"])
def test_impossible_name_is_refused(text):
    with pytest.raises(MalformedMessage):
        DdsName.parse(text)


def test_impossible_name_is_shown_escaped():
    with pytest.raises(MalformedMessage) as error:
        DdsName.parse("rt/a\x1b[31m")
    assert "\x1b" not in str(error.value)


@pytest.mark.parametrize("text", ["", "Float64", "a::b::c", "std_msgs::msg::Float64_::x::y"])
def test_impossible_type_is_refused(text):
    with pytest.raises(MalformedMessage):
        type_of(text)


def test_user_data_is_read_as_written():
    assert user_data(clientid=" 1.2", typehash="RIHS01_ab") == b"clientid= 1.2;typehash=RIHS01_ab;"
    assert read_user_data(b"clientid= 1.2;typehash=RIHS01_ab;") == {"clientid": " 1.2", "typehash": "RIHS01_ab"}


@pytest.mark.parametrize("data", [b"", b";", b"\xff\xfe", b"=" * 100_000, b"typehash", bytes(5000)])
def test_any_user_data_can_be_read(data):
    assert "typehash" not in read_user_data(data)


def test_id_of_a_client_is_rmw_cyclonedds_s():
    participant = bytes.fromhex("0110aabbccddeeff00112233000001c1")
    assert service_end_id(participant, 258) == " 1.10.aa.bb.cc.dd.ee.ff.0.11.22.33.0.0.1.2"
