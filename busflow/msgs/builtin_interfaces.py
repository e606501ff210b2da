"""`builtin_interfaces`: a point in time and a span of time."""

from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from busflow.interfaces.message import Message, int32, uint32

__all__ = ["Duration", "Time"]


class Time(Message, package="builtin_interfaces"):
    """A point in time of the clock that the context means.

    Where a message has a field of this type, the time of a clock is taken too: `Header(stamp=clock.now())`.
    """

    sec: int32 = 0
    """Whole seconds since the clock's epoch, rounded down."""
    nanosec: uint32 = 0
    """Nanoseconds since that second, below 1,000,000,000."""

    __takes_to_msg__: ClassVar[bool] = True

    if TYPE_CHECKING:  # a type checker lets a field's class say what may be given for it

        def __get__(self, message: object, owner: Any = None) -> "Time": ...
        def __set__(self, message: object, value: "Time | _MakesTime") -> None: ...


class Duration(Message, package="builtin_interfaces"):
    """A span of time, negative when `sec` is. Fields of this type take a clock's Duration too."""

    sec: int32 = 0
    """Whole seconds, rounded down."""
    nanosec: uint32 = 0
    """Nanoseconds to add, below 1,000,000,000."""

    __takes_to_msg__: ClassVar[bool] = True

    if TYPE_CHECKING:

        def __get__(self, message: object, owner: Any = None) -> "Duration": ...
        def __set__(self, message: object, value: "Duration | _MakesDuration") -> None: ...


if TYPE_CHECKING:

    class _MakesTime(Protocol):
        def to_msg(self) -> "Time": ...

    class _MakesDuration(Protocol):
        def to_msg(self) -> "Duration": ...
