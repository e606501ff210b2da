"""A node that logs the first balance of the lab, at its start and after each change of a parameter."""

from busflow import Node, subscription
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.msgs.std_msgs import Float64


class Witness(Node):
    """Logs whether that balance is steady."""

    async def start(self) -> None:
        self.awaited = "start"

    @subscription("/parameter_events")
    def on_event(self, event: ParameterEvent) -> None:
        for parameter in event.changed_parameters:
            self.awaited = f"{parameter.name} = {parameter.value.double_value}"

    @subscription("balance_state")
    def on_balance(self, balance: Float64) -> None:
        if self.awaited:
            self.log.info("balance", after=self.awaited, steady=balance.data == 0.0)
            self.awaited = ""
