"""Joysticks and gamepads."""

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.message import Float32Array, Int32Array, Message, float32, uint8, zeros
from busflow.msgs.std_msgs import Header


class Joy(Message, package="sensor_msgs"):
    """Where the sticks are and which buttons are pressed."""

    header: Header = Header()
    """`stamp` is when the joystick was read."""
    axes: Float32Array = zeros()
    """-1 to 1 each."""
    buttons: Int32Array = zeros()
    """1 where pressed."""


class JoyFeedback(Message, package="sensor_msgs"):
    """What a joystick should do for the hand that holds it."""

    TYPE_LED: ClassVar[uint8] = 0
    TYPE_RUMBLE: ClassVar[uint8] = 1
    TYPE_BUZZER: ClassVar[uint8] = 2

    type: uint8 = 0
    """One of the constants."""
    id: uint8 = 0
    """Which one of that type, counting from 0."""
    intensity: float32 = 0.0
    """0 to 1; what knows only on and off is on from 0.5."""


class JoyFeedbackArray(Message, package="sensor_msgs"):
    """Several things that a joystick should do at once."""

    array: Sequence[JoyFeedback] = ()
