"""Types read from their source are those of their classes."""

import pytest

from busflow.interfaces.encoding.builtin_types import shipped_types
from busflow.interfaces.encoding.typesupport import describe
from busflow.interfaces.message import find_type

SHIPPED = shipped_types()


@pytest.mark.parametrize("name", SHIPPED.messages)
def test_a_message_read_from_its_source_is_that_of_its_class(name: str):
    assert SHIPPED.description(name) == describe(find_type(name))


@pytest.mark.parametrize("name", SHIPPED.services)
@pytest.mark.parametrize("part", ["Request", "Response"])
def test_so_are_the_two_halves_of_a_service(name: str, part: str):
    assert SHIPPED.description(f"{name}_{part}") == describe(getattr(find_type(name), part))


def test_comments_are_those_of_the_source():
    imu = SHIPPED.comments("sensor_msgs/msg/Imu")
    assert imu.text.startswith("What an inertial measurement unit measures.")
    assert imu.fields["orientation"] == "Of the sensor's frame relative to the world."
    assert SHIPPED.comments("std_srvs/srv/SetBool").text == "Switches something on or off."
