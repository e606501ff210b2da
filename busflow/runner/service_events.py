"""Service events: a call of a service as the messages of ROS 2's service introspection."""

from __future__ import annotations

import hashlib
import types
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, cast

import numpy as np

from busflow.bus.services.call import Call
from busflow.bus.services.server import Server
from busflow.clock import Time
from busflow.interfaces.message import Length, Message, ServiceType, type_name
from busflow.msgs.service_msgs import ServiceEventInfo

if TYPE_CHECKING:
    from busflow.bus.services.service import Service

SUFFIX = "/_service_event"
"""The suffix that makes the event topic's name of a service's name."""

_GID_BYTES = 16


@cache
def event_class(service: type[ServiceType]) -> type[Message]:
    """Return the message type `…_Event` of a service.

    >>> from busflow.msgs.std_srvs import Trigger
    >>> type_name(event_class(Trigger))
    'std_srvs/srv/Trigger_Event'
    """
    annotations = {
        "info": ServiceEventInfo,
        "request": Annotated[tuple[service.Request, ...], Length(max=1)],  # pyright: ignore[reportInvalidTypeForm]  # a class all the same
        "response": Annotated[tuple[service.Response, ...], Length(max=1)],  # pyright: ignore[reportInvalidTypeForm]  # a class all the same
    }
    name = f"{service.__name__}Event"
    package = type_name(service).partition("/")[0]

    def fill(body: dict[str, Any]) -> None:
        body["__annotations__"] = annotations
        body["__module__"] = __name__
        body["__doc__"] = f"One step of a call of {type_name(service)}."
        body |= {"info": ServiceEventInfo(), "request": (), "response": ()}

    made = types.new_class(name, (Message,), {"package": package}, fill)
    made.__ros_name__ = f"{type_name(service)}_Event"
    return cast("type[Message]", made)


def event_message(cls: type[Message], call: Call[Any, Any], stamp: Time) -> Message | None:
    """Return the event message of a call now: its request or its answer; None if it was not answered.

    Args:
        cls: as `event_class` made it.
        call: the call.
        stamp: the time.
    """
    outcome = call.outcome
    if outcome is None:
        kind, fields = ServiceEventInfo.REQUEST_RECEIVED, {"request": (call.request,)}
    elif isinstance(outcome, Message):
        kind, fields = ServiceEventInfo.RESPONSE_SENT, {"response": (outcome,)}
    else:
        return None
    info = ServiceEventInfo(
        event_type=kind, stamp=stamp.to_msg(), client_gid=client_gid(call.caller), sequence_number=call.number
    )
    made: Any = cls  # a type checker knows the fields of none that is made while the program runs
    return made(info=info, **fields)


def client_gid(caller: str) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return the id of a client: the same for the same node in every run."""
    return np.frombuffer(hashlib.blake2b(caller.encode(), digest_size=_GID_BYTES).digest(), np.uint8)


def is_elsewhere(call: Call[Any, Any], service: Service[Any, Any], known: set[int]) -> bool:
    """Return whether a server of another process answers a call; `known` holds such calls while they last."""
    if call.outcome is None and not isinstance(service.server, Server | None):
        known.add(call.number)
        return True
    found = call.number in known
    if call.outcome is not None:
        known.discard(call.number)
    return found
