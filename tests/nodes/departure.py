"""A node that writes into a named pipe when a publisher has gone: its log would go through the main process."""

from pathlib import Path

from busflow import Node, SubscriptionMatched, on_event, subscription
from busflow.msgs.std_msgs import Int64


class Departure(Node):
    """Writes into the pipe `gone`, some seconds after the first publisher has left."""

    is_gone = False

    @subscription("numbers")
    def on_number(self, _number: Int64) -> None: ...

    @on_event("numbers")
    def on_matched(self, event: SubscriptionMatched) -> None:
        if event.current_change < 0 and not self.is_gone:
            self.is_gone = True
            self.spawn(self.write())

    async def write(self) -> None:
        await self.clock.sleep(4.0)  # by then nobody tries to reach the main process every second any more
        Path("gone").write_text("gone")
