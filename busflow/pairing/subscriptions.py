"""`subscription`: receives a topic; with `in_frame=` its messages wait for the transform to a frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar, overload

from busflow.bus.qos import QoS, checked_qos
from busflow.clock import NS_PER_S
from busflow.errors import InvalidDeclaration
from busflow.interfaces.message import Message
from busflow.node import handlers
from busflow.node.declarations import PullDeclaration, checked_name
from busflow.validation.durations import parse_duration

if TYPE_CHECKING:
    from busflow.pairing.in_frame import InFrameDeclaration

M = TypeVar("M", bound=Message)
P = ParamSpec("P")
R = TypeVar("R")

_WAIT_S = 0.1


@overload
def subscription(topic: str, /, *, qos: QoS | None = None) -> handlers.HandlerDecorator: ...
@overload
def subscription(
    topic: str, /, *, qos: QoS | None = None, in_frame: str, wait: str | float = _WAIT_S
) -> Callable[[Callable[Concatenate[Any, P], R]], InFrameDeclaration[P, R]]: ...
@overload
def subscription(message_type: type[M], topic: str, /, qos: QoS | None = None) -> PullDeclaration[M]: ...
def subscription(
    message_type: Any,
    topic: Any = None,
    /,
    qos: QoS | None = None,
    *,
    in_frame: str | None = None,
    wait: str | float | None = None,
) -> Any:
    """Receive a topic: above a handler, or as an attribute to pull from.

    Write `@subscription("imu/data")` above a method, or `imu = subscription(Imu, "imu/data")`. The handler's annotation
    states the type of message; a plain `def` is atomic, an `async def` is handed one message at a time. The attribute
    is pulled from: `async for`, `.latest`.

    With `in_frame="map"` a message is handed over once the transform from its frame to `map` at its stamp is there;
    after `wait`, 100 ms unless said, it is a drop with the reason `no_transform`.
    """
    if in_frame is None and wait is None:
        return handlers.subscription(message_type, topic, qos=qos)
    if not isinstance(message_type, str) or topic is not None or in_frame is None:
        raise InvalidDeclaration('in_frame= and wait= are for a handler: write @subscription("scan", in_frame="map")')
    target = checked_name(in_frame, "@subscription(…, in_frame=…)", "frame")
    try:
        wait_ns = round(parse_duration(_WAIT_S if wait is None else wait) * NS_PER_S)
    except (ValueError, OverflowError) as error:
        raise InvalidDeclaration(f"@subscription(…, wait=…): {error}") from None
    checked = checked_qos(qos, "@subscription(…)")

    def decorate(function: Any) -> Any:
        from busflow.pairing.in_frame import InFrameDeclaration  # most nodes need no frames

        return InFrameDeclaration(function, message_type, checked, target, wait_ns)

    return decorate
