"""Message definitions: a description as the text of a `.msg` file and back, which is how MCAP stores ROS 2's types.

The types inside follow, each after a line of 80 `=` and its name. Comments are not kept.
"""

from __future__ import annotations

import re

from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.description import (
    PRIMITIVES,
    ConstantDescription,
    Count,
    Field,
    FieldDescription,
    IndividualDescription,
    TypeDescription,
    assemble,
    check,
    fields_of,
    individual,
    is_empty,
)

ENCODING = "ros2msg"
"""MCAP's name of this form."""

_RULE = "=" * 80
# Nineteen digits are more than any size has; Python refuses to read a number of more than 4,300.
_TYPE = re.compile(r"(?P<base>\w+(/\w+)*)(<=(?P<bound>\d{1,19}))?(\[(?P<limit><=)?(?P<size>\d{0,19})\])?", re.ASCII)
_LINE = re.compile(r"(?P<type>\S+)\s+(?P<name>\w+)\s*(?P<constant>=(?!=))?\s*(?P<value>.*)", re.ASCII)
_COMMENT = re.compile(r"""((?:[^#"']|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')*)#.*""")


def ros2msg(description: TypeDescription) -> str:
    """Return the definition of a type, then of each type inside it."""
    others = description["referenced_type_descriptions"]
    inner = [f"{_RULE}\nMSG: {_short(each['type_name'])}\n{_text(each)}" for each in others]
    return "\n".join([_text(description["type_description"]), *inner])


def parse(name: str, text: str) -> TypeDescription:
    """Parse a definition: return the description of the type `name` and of the types inside it.

    Raises:
        MalformedMessage: The text is no definition, or lacks one of the types inside.
    """
    name = _long(name, name)
    types: dict[str, IndividualDescription] = {}
    current, lines = name, list[tuple[int, str]]()
    for number, line in enumerate(text.splitlines(), start=1):
        if re.fullmatch(r"={3,}\s*", line):
            types[current], lines = _parsed(current, lines), []
            current = ""
        elif line.startswith("MSG:") and not current:
            current = _long(line.removeprefix("MSG:").strip(), name)
        else:
            lines.append((number, line))
    types[current] = _parsed(current, lines)
    return check(assemble(name, types))


def _text(described: IndividualDescription) -> str:
    """Return a type in the lines of a `.msg` file, its constants first."""
    constants = [f"{each['type']} {each['name']}={each['value']}\n" for each in described.get("constants", [])]
    fields = () if is_empty(described) else fields_of(described)
    return "".join([*constants, *(f"{_type(field)} {field.name} {field.default}".rstrip() + "\n" for field in fields)])


def _type(field: Field) -> str:
    base = _short(field.base) if field.nested else field.base
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


def _long(name: str, around: str) -> str:
    """Return the full name of a type that the definition of the type `around` mentions."""
    parts = name.split("/")
    if len(parts) == 1:
        return "std_msgs/msg/Header" if name == "Header" else f"{around.partition('/')[0]}/msg/{name}"
    return f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else name


def _parsed(name: str, lines: list[tuple[int, str]]) -> IndividualDescription:
    if not name:
        raise MalformedMessage("a line of === is followed by the line MSG: package/Name")
    fields: list[FieldDescription] = []
    constants: list[ConstantDescription] = []
    for number, line in lines:
        comment = _COMMENT.match(line)
        if not (bare := (comment[1] if comment else line).strip()):
            continue
        found = _LINE.fullmatch(bare)
        kind = _TYPE.fullmatch(found["type"]) if found else None
        if found is None or kind is None:
            raise MalformedMessage(f"line {number}: {line!r:.80} declares neither field nor constant", type_name=name)
        if found["constant"]:
            constants.append({"name": found["name"], "type": kind["base"], "value": found["value"].strip()})
        else:
            fields.append(_field(kind, found["name"], found["value"].strip(), name).describe())
    return individual(name, fields, constants)


def _field(kind: re.Match[str], name: str, default: str, around: str) -> Field:
    nested = kind["base"] not in PRIMITIVES
    base = _long(kind["base"], around) if nested else kind["base"]
    count = Count.ONE
    if kind["size"] is not None:
        count = Count.BOUNDED if kind["limit"] else Count.FIXED if kind["size"] else Count.UNBOUNDED
    return Field(name, base, nested, count, int(kind["size"] or 0), int(kind["bound"] or 0), default)
