"""Warns once when it gets too hot."""

from pydantic import Field

from busflow import Node, Parameters, subscription
from busflow.msgs.sensor_msgs import Temperature


class AlarmParameters(Parameters):
    limit: float = Field(default=25.0, description="The highest temperature without a warning, °C.")


class Alarm(Node):
    """Warns when the temperature passes the limit."""

    parameters: AlarmParameters
    is_hot = False

    @subscription("temperature")
    def on_temperature(self, message: Temperature) -> None:
        was_hot, self.is_hot = self.is_hot, message.temperature > self.parameters.limit
        if self.is_hot and not was_hot:
            self.log.warning("too hot", celsius=message.temperature)
