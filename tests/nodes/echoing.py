"""A node that echoes numbers, and one that takes its time to stop."""

from busflow import Node, QoS, publisher, subscription
from busflow.msgs.std_msgs import Int64


class Slow(Node):
    """Lets nodes before it go on for 0.4 s while it stops."""

    async def stop(self) -> None:
        await self.clock.sleep(0.4)


class Echo(Node):
    """Publishes each number again."""

    echoes = publisher(Int64, "echoes")

    @subscription("numbers", qos=QoS(depth=1000))
    def on_number(self, number: Int64) -> None:
        self.echoes.publish(number)
        if number.data == 20:
            self.log.info("received enough")
