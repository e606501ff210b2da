"""Shared fixtures: plugins, and the plan of a launch file that uses them."""

import pytest

from busflow.clock import SystemClock
from busflow.launchfile.load.load import load
from busflow.log import Log
from busflow.runner.planning.preflight import Plan, Preflight
from tests.launch_folder import folder, machines

__all__ = ["check", "folder", "machines"]

PLUGINS = {
    "talker": """
        from pydantic import Field
        from busflow import Node, Parameters, publisher
        from busflow.msgs.std_msgs import Float64

        class TalkerParameters(Parameters):
            rate_hz: float = Field(default=10.0, gt=0, le=100)
            broken: bool = False

        class Talker(Node):
            parameters: TalkerParameters
            numbers = publisher(Float64, "numbers")

            def declare(self) -> None:
                if self.parameters.broken:
                    self.nothing.happens()
        """,
    "listener": """
        from busflow import Node, subscription
        from busflow.msgs.std_msgs import Float64

        class Listener(Node):
            @subscription("numbers")
            def on_number(self, number: Float64) -> None: ...
        """,
    "reader": """
        from busflow import Node, subscription
        from busflow.msgs.std_msgs import String

        class Reader(Node):
            @subscription("numbers")
            def read(self, text: String) -> None: ...
        """,
    "initial": """
from busflow import Node


class Initial(Node):
    def __init__(self):
        super().__init__("initial")
""",
    "hinting": """
        from typing import TYPE_CHECKING
        from busflow import Node, subscription
        if TYPE_CHECKING:
            from busflow.msgs.std_msgs import Float64

        class Hinting(Node):
            @subscription("numbers")
            def on_number(self, number: "Float64") -> None: ...
        """,
    "lonely": """
        from busflow import Node, client
        from busflow.msgs.std_srvs import Trigger

        class Lonely(Node):
            reset = client(Trigger, "reset")
        """,
    "empty": "",
    "stately": """
        from busflow import Node, QoS
        from busflow.msgs.std_msgs import Float64

        class Stately(Node):
            def declare(self) -> None:
                self.create_subscription(Float64, "numbers", None, QoS(durability="transient_local"))
        """,
    "sensor": """
        from busflow import SENSOR_DATA, Node, publisher
        from busflow.msgs.std_msgs import Float64

        class Sensor(Node):
            numbers = publisher(Float64, "numbers", qos=SENSOR_DATA)
        """,
    "named": """
        from busflow import Node, publisher
        from busflow.msgs.std_msgs import Float64

        class Named(Node):
            numbers = publisher(Float64, "not//a name")
        """,
}


@pytest.fixture
def check(folder):
    """Return a function that writes a launch file beside the plugins above and returns its plan."""
    for name, text in PLUGINS.items():
        folder.write(text, f"plugins/{name}.py")

    def plan(text: str, *, strict: bool = False) -> Plan:
        folder.write(text)
        clock = SystemClock()
        return Preflight(clock, Log(clock), strict=strict).plan([load("lab1.yaml", environment={})])

    return plan
