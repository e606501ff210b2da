from typing import Literal

from pydantic import Field

from busflow import Node, Parameters, client, publisher, service, subscription
from busflow.msgs.std_msgs import Bool, Float64
from busflow.msgs.std_srvs import Trigger


class ChoosyParameters(Parameters):
    side: Literal["left", "right"]
    gain: float = Field(default=1.0, gt=0, le=10, description="How much.")


class Choosy(Node):
    """Wants to know a side."""

    parameters: ChoosyParameters
    ready = publisher(Bool, "~/ready")

    @subscription("numbers")
    def receive(self, number: Float64) -> None: ...

    other = client(Trigger, "other")

    @service(Trigger, "~/reset")
    def on_reset(self, request: Trigger.Request) -> Trigger.Response: ...
