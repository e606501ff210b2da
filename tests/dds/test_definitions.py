"""Two definitions of one type, one in the run and one that a neighbour in DDS describes."""

import pytest

from tests.dds.conftest import staged

LAB = """
import sys
import busflow
from busflow import Message, Node, subscription

class Reading(Message, package="lab"):
    value: float = 0.0

class Robot(Node):
    async def start(self) -> None:
        self.log.info("ready")

    @subscription("/reading")
    def on_reading(self, reading: Reading) -> None: ...

sys.exit(busflow.run(Robot, inspect="robot"))
"""
THEIRS = "RIHS01_718ac5c7988bb6956779aa5af2822c6ccf0da5e278ec7f034a0660b104db500c"
"""The hash of the definition that `description_peer.py` has."""
DIFF = """\
  --- /robot
  +++ /camera
  @@ -1 +1,2 @@
  -float64 value
  +float32 value
  +int64 quality
"""


@pytest.fixture
def stage():
    """A run that receives a type of its own, with its bridge."""
    with staged("-c", LAB) as found:
        found.robot.wait_for("ready")
        found.bridge = found.open_bridge()
        yield found


def test_definitions_are_shown_as_a_diff(stage, golden):
    camera = stage.peer("enclave=/;", program="description_peer.py")
    camera.do("advertise", topic="rt/reading", kind="Reading", data=f"typehash={THEIRS};")
    camera.do("describe", node="camera")
    camera.do("list_nodes", nodes=[{"name": "camera", "topics": ["rt/reading", "camera/get_type_description"]}])
    golden(stage.bridge.wait_for("lab/msg/Reading on /reading"), mask={r"^[\d:.]+ ": ""})
    stage.until("/camera/get_type_description", "service", "list", "--include-hidden-services")
    assert DIFF in stage.busflow("doctor")
