"""A definition says all of a description, as rosbags and busflow read it."""

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from busflow.definitions.recorded import parse
from busflow.interfaces.encoding.description import rihs01
from busflow.interfaces.encoding.msg_text import ros2msg
from busflow.interfaces.encoding.typesupport import describe
from busflow.interfaces.message import find_type
from tests.interfaces.any_message import MESSAGES

ROS = get_typestore(Stores.LATEST)

each_package = pytest.mark.parametrize("package", sorted({name.partition("/")[0] for name in MESSAGES}))


def messages_of(package):
    return [name for name in MESSAGES if name.startswith(f"{package}/")]


@each_package
def test_a_definition_is_read_back_as_its_description(package):
    for name in messages_of(package):
        described = describe(MESSAGES[name])
        assert parse(name, ros2msg(described)) == described


@each_package
def test_rosbags_reads_the_definition_as_ros_s_type(package):
    for name in messages_of(package):
        for inner, (_, fields) in get_types_from_msg(ros2msg(describe(MESSAGES[name])), name).items():
            known = ROS.fielddefs.get(inner, (None, fields))[1]
            known = [field for field in known if field[0] != "structure_needs_at_least_one_member"]
            # In a .msg file a char is a uint8, and that is how it is described; rosbags alone keeps the word.
            assert (inner, str(fields).replace("'char'", "'uint8'")) == (inner, str(known).replace("'char'", "'uint8'"))


@each_package
def test_the_definition_of_rosbags_describes_the_same_type(package):
    for name in messages_of(package):
        if name in ROS.fielddefs:
            text, _ = ROS.generate_msgdef(name, ros_version=2)
            parsed = parse(name, text.replace("char[16] client_gid", "uint8[16] client_gid"))
            assert (name, rihs01(parsed)) == (name, rihs01(describe(MESSAGES[name])))


@pytest.mark.parametrize("name", ["geometry_msgs/QuaternionStamped", "sensor_msgs/NavSatStatus"])
def test_a_definition_as_recordings_hold_it(golden, name):
    golden(ros2msg(describe(find_type(name))), mask={"=": "-"})
