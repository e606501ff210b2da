from busflow import Node, subscription
from busflow.msgs.std_msgs import Float64


class Driven(Node):
    @subscription("cmd_vel")
    def on_command(self, speed: Float64) -> None: ...

    async def start(self) -> None:
        self.log.warning("ready")
