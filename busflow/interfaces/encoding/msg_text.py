"""Message definitions: a description as the text of a `.msg` file, which is how MCAP stores ROS 2's types.

The types inside follow, each after a line of 80 `=` and its name. `busflow.definitions.recorded` reads it back.
"""

from __future__ import annotations

from operator import itemgetter

from busflow.interfaces.encoding.description import (
    Count,
    Field,
    IndividualDescription,
    TypeDescription,
    fields_of,
    is_empty,
)

ENCODING = "ros2msg"
"""MCAP's name of this form."""

_RULE = "=" * 80


def ros2msg(description: TypeDescription) -> str:
    """Return the definition of a type, then of each type inside it."""
    others = description["referenced_type_descriptions"]
    inner = [f"{_RULE}\nMSG: {_short(each['type_name'])}\n{_text(each)}" for each in others]
    return "\n".join([_text(description["type_description"]), *inner])


def _text(described: IndividualDescription) -> str:
    """Return a type in the lines of a `.msg` file, in the order in which they were written."""
    fields = () if is_empty(described) else fields_of(described)
    lines = [(index, f"{type_text(field)} {field.name} {field.default}".rstrip()) for index, field in enumerate(fields)]
    lines += [
        (each.get("above", 0) - 0.5, f"{each['type']} {each['name']}={each['value']}")
        for each in described.get("constants", [])
    ]
    return "".join(f"{line}\n" for _, line in sorted(lines, key=itemgetter(0)))


def type_text(field: Field, package: str = "") -> str:
    """Return the type of a field as a `.msg` file of a package writes it."""
    base = _short(field.base).removeprefix(f"{package}/") if field.nested else field.base
    bound = f"<={field.string_bound}" if field.string_bound else ""
    match field.count:
        case Count.ONE:
            return base + bound
        case Count.UNBOUNDED:
            return f"{base}{bound}[]"
        case _:
            return f"{base}{bound}[{'<=' if field.count is Count.BOUNDED else ''}{field.size}]"


def _short(name: str) -> str:
    """Return `std_msgs/msg/Header` as `std_msgs/Header`, the form that every reader of MCAP knows."""
    parts = name.split("/")
    return f"{parts[0]}/{parts[2]}" if len(parts) == 3 and parts[1] == "msg" else name
