"""What has changed in definition files since the classes of a graph were written."""

import pytest

from busflow.launchfile.load.load import load
from busflow.runner.planning.definitions import definition_problems

LAUNCH = "plugins: [plugins]\n{}nodes: {{gripper: {{plugin: gripper}}}}\n"
GRIPPER = """
from busflow import Message, Node, ServiceType, publisher, service


class Grip(Message, package="arm_msgs"):
    force: float


class Close(ServiceType, package="arm_msgs"):
    class Request(Message):
        grip: Grip

    class Response(Message):
        is_held: bool


class Gripper(Node):
    grips = publisher(Grip, "grips")

    @service(Close, "close")
    def close(self, request: Close.Request) -> Close.Response:
        return Close.Response(is_held=True)
"""


@pytest.fixture
def problems(folder, check):
    """Return a function that reports what is wrong with the classes above where definition files say something else."""
    folder.write(GRIPPER, "plugins/gripper.py")
    folder.write("float64 force\n", "src/arm_msgs/msg/Grip.msg")
    folder.write("Grip grip\n---\nbool is_held\n", "src/arm_msgs/srv/Close.srv")

    def problems(interfaces: str = "interfaces: [src]\n") -> str:
        plan = check(LAUNCH.format(interfaces))
        assert plan.is_whole
        description = load("lab1.yaml", environment={})
        return "\n".join(each.render() for each in definition_problems(description, plan.nodes))

    return problems


def test_definitions_as_written_are_no_problem(problems):
    assert problems() == ""


def test_without_folders_of_interfaces_nothing_is_compared(problems, folder):
    folder.write("float32 force\n", "src/arm_msgs/msg/Grip.msg")
    assert problems("") == ""


@pytest.mark.parametrize(
    ("file", "text", "line"),
    [("msg/Grip.msg", "float32 force\n", 5), ("srv/Close.srv", "Grip grip\n---\nbool held\n", 9)],
)
def test_changed_definition_is_found_once(problems, folder, file, text, line):
    folder.write(text, f"src/arm_msgs/{file}")
    report, name = problems(), f"arm_msgs/{file.partition('.')[0]}"
    assert report.count("error") == 1
    assert f"plugins/gripper.py:{line}:1: error: src/arm_msgs/{file} " in report
    assert f" {name}" in report


def test_mistake_in_definition_is_reported_itself(problems, folder):
    folder.write("float64 force\nfloat64\n", "src/arm_msgs/msg/Grip.msg")
    assert problems().startswith("src/arm_msgs/msg/Grip.msg:2:8: error: ")
