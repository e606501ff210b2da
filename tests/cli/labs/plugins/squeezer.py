from collections.abc import Sequence

from busflow import ActionType, Message, Node, action_client, publisher


class Grip(Message, package="talk_msgs"):
    """How firmly."""

    force: float = 0.0
    names: Sequence[str] = ()


class Label(Message, package="talk_msgs"):
    """Message with a field that no definition file of ROS 2 can state."""

    text: str
    place: str | None = "shelf"


class Squeeze(ActionType, package="talk_msgs"):
    """Closes."""

    class Goal(Message):
        """How firmly."""

        grip: Grip = Grip()

    class Result(Message):
        """Whether it holds."""

        held: bool = False

    class Feedback(Message):
        """Nothing."""


class Squeezer(Node):
    """Has types of its own."""

    squeeze = action_client(Squeeze, "squeeze")

    grips = publisher(Grip, "grips")
    labels = publisher(Label, "labels")

    async def start(self) -> None:
        self.log.info("ready")
