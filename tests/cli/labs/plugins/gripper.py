from busflow import Node, client, service
from busflow.msgs.std_srvs import Trigger


class Gripper(Node):
    """Drops all it grips."""

    camera = client(Trigger, "camera/take")

    async def start(self) -> None:
        self.log.warning("ready")

    @service(Trigger, "~/grip")
    def grip(self, _request: Trigger.Request) -> Trigger.Response:
        raise RuntimeError("it slipped")
