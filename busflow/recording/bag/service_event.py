"""The type of a service's events, of which bags of ROS 2 hold no definition but that of the service itself.

A bag names the type `pkg/srv/Name_Event` and gives the text of the `.srv` file: request, `---`, response. What an event
has around them is the same for every service (ROS 2's REP 2012): `info`, and at most one of each.
"""

from __future__ import annotations

import re

from busflow.interfaces.encoding.builtin_types import builtin_types
from busflow.interfaces.encoding.description import (
    SERVICE_EVENT_INFO,
    TypeDescription,
    assemble,
    check,
    service_types,
    types_in,
)
from busflow.interfaces.encoding.msg_text import parse

_EVENT = "_Event"
_BETWEEN = re.compile(r"^---[ \t]*$", re.MULTILINE)
_TYPES_INSIDE = re.compile(r"^={3,}[ \t]*$", re.MULTILINE)


def is_service_event_type(name: str, text: str) -> bool:
    """True if this definition is the event type of the service whose events these are."""
    return name.endswith(_EVENT) and _BETWEEN.search(text) is not None


def event_description(name: str, text: str) -> TypeDescription:
    """The description of a service's event, from the text of the service.

    Raises:
        MalformedMessage: The text is none, or lacks one of the types inside.
    """
    service = name.removesuffix(_EVENT)
    request, rest = _BETWEEN.split(text, maxsplit=1)
    inside = _TYPES_INSIDE.search(rest)
    response, others = (rest, "") if inside is None else (rest[: inside.start()], rest[inside.start() :])
    parts = [
        parse(f"{service}_Request", request + others),
        parse(f"{service}_Response", f"{response}\n{others}"),
        builtin_types().description(SERVICE_EVENT_INFO),
    ]
    types = {part: each for whole in parts for part, each in types_in(whole).items()}
    return check(assemble(name, types | {each["type_name"]: each for each in service_types(service)}))
