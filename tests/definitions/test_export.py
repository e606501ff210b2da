"""Definition files of classes: fields, constants and comments as ROS 2 writes them, and what a workspace builds."""

from typing import ClassVar

import pytest

from busflow import ActionType, Message
from busflow.definitions.export import exported
from busflow.errors import InvalidDeclaration
from busflow.interfaces.field_types import uint8
from busflow.msgs.std_msgs import Header


class Reading(Message, package="lab_msgs"):
    """One reading of a gauge."""

    GOOD: ClassVar[uint8] = 1
    """It can be trusted."""
    header: Header = Header()
    value: float = 0.5
    """In volts."""


class Weigh(ActionType, package="lab_msgs"):
    """The action `lab_msgs/action/Weigh`."""

    class Goal(Message):
        name: str = "left"

    class Result(Message):
        reading: Reading = Reading()

    class Feedback(Message):
        """What the gauge shows meanwhile."""

        value: float = 0.0


class Lines(Message, package="lab_msgs"):
    text: str = "one\ntwo"


def test_package_has_definitions_with_comments_and_dependencies(golden):
    files = exported("lab_msgs", [Weigh, Reading], "MIT")
    assert list(files) == ["package.xml", "CMakeLists.txt", "action/Weigh.action", "msg/Reading.msg"]
    for name, text in files.items():
        golden(text, name)


def test_default_of_several_lines_is_refused():
    with pytest.raises(InvalidDeclaration, match=r"^Lines: "):
        exported("lab_msgs", [Lines], "MIT")
