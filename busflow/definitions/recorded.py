"""Definitions as recordings hold them: a type and all within it in one text, parted by lines of `=`."""

from __future__ import annotations

import re

from busflow.definitions.definition import Kind, kind_of
from busflow.definitions.field_type import full_name
from busflow.definitions.reader import MAX_BYTES, read_text
from busflow.errors import InvalidDefinition, MalformedMessage
from busflow.interfaces.encoding.builtin_types import builtin_types
from busflow.interfaces.encoding.description import (
    SERVICE_EVENT_INFO,
    IndividualDescription,
    TypeDescription,
    assemble,
    check,
)

_RULE = re.compile(r"={3,}[ \t]*")
_SEPARATOR = re.compile(r"^---[ \t]*\r?$", re.MULTILINE)
_EVENT = "_Event"


def parse(name: str, text: str) -> TypeDescription:
    """Parse a definition: return the description of the type `name` and of the types inside it.

    Bags of ROS 2 describe the events of a service by the `.srv` file: what an event has around its request and response
    is the same for every service.

    Raises:
        MalformedMessage: The text is no definition, or lacks one of the types inside.
    """
    if len(text) > MAX_BYTES:
        raise MalformedMessage(f"a definition has at most {MAX_BYTES} characters", type_name=name)
    package = name.partition("/")[0]
    whole = full_name(name, package)
    service = whole.removesuffix(_EVENT)
    is_event = service != whole and kind_of(whole) is Kind.SERVICE and _SEPARATOR.search(text) is not None
    types: dict[str, IndividualDescription] = {}
    try:
        for number, (inner, lines) in _sections(text):
            current = full_name(inner, package) if inner else service if is_event else whole
            kind = Kind.SERVICE if is_event and not inner else Kind.MESSAGE
            read = read_text(current, "\n".join(lines), name, kind=kind, first_line=number, lenient=True)
            types |= read.types()
    except InvalidDefinition as error:
        problem = error.problems[0]
        place = f"line {problem.place.line}, column {problem.place.column}: " if problem.place else ""
        raise MalformedMessage(f"{place}{problem.message}", type_name=name) from None
    if is_event:
        types.setdefault(SERVICE_EVENT_INFO, builtin_types().within(SERVICE_EVENT_INFO)[SERVICE_EVENT_INFO])
        types |= builtin_types().within("builtin_interfaces/msg/Time") | types
    return check(assemble(whole, types))


def _sections(text: str) -> list[tuple[int, tuple[str, list[str]]]]:
    """Return each type's first line number, name (empty for the first) and lines."""
    sections: list[tuple[int, tuple[str, list[str]]]] = [(1, ("", []))]
    expected = False
    for number, line in enumerate(text.split("\n"), start=1):
        if _RULE.fullmatch(line.removesuffix("\r")):
            expected = True
        elif expected and line.startswith("MSG:"):
            sections.append((number + 1, (line.removeprefix("MSG:").strip(), [])))
            expected = False
        elif expected:
            raise MalformedMessage(f"line {number}: a line of === is followed by the line MSG: package/Name")
        else:
            sections[-1][1][1].append(line)
    return sections
