"""A battery that empties."""

from busflow import Node, publisher, service, timer
from busflow.msgs.sensor_msgs import BatteryState
from busflow.msgs.std_srvs import Trigger


class Battery(Node):
    """Publishes its charge ten times a second."""

    states = publisher(BatteryState, "battery")

    async def start(self) -> None:
        self.charge = 1.0

    @timer(hz=10)
    def drain(self) -> None:
        self.charge = max(0.0, self.charge - 0.001)
        self.states.publish(BatteryState(percentage=self.charge))

    @service(Trigger, "charge")
    def fill(self, _request: Trigger.Request) -> Trigger.Response:
        self.charge = 1.0
        return Trigger.Response(success=True, message="full")
