from busflow import ActionType, Message, Node, publisher


class Hold(ActionType, package="squeeze_robot"):
    """Holds a thing."""

    class Goal(Message):
        """How long."""

        seconds: float = 2.0

    class Result(Message):
        """Nothing."""

    class Feedback(Message):
        left: float = 0.0
        """In seconds."""


class Squeeze(Message, package="squeeze_robot"):
    """How hard."""

    force: float = 1.0
    """In newtons."""


class Squeezer(Node):
    squeeze = publisher(Squeeze, "squeeze")
