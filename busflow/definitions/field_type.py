"""Types of fields as definition files write them: `string<=10[<=3]`, `float64[9]`, `geometry_msgs/Pose[]`."""

from __future__ import annotations

import re

from busflow.interfaces.encoding.description import PRIMITIVES, Count, Field
from busflow.text import nearest, quoted

_SHAPE = re.compile(r"(?P<base>[^<\[]*)(?P<bound><[^\[]*)?(?P<array>\[.*)?")
_BOUND = re.compile(r"<=([0-9]{1,10})")
_ARRAY = re.compile(r"\[(<=)?([0-9]{0,10})\]")
_PACKAGE = re.compile(r"[a-z](_?[a-z0-9])*")
_TYPE = re.compile(r"[A-Z][A-Za-z0-9]*")
_ANY = re.compile(r"\w+(/\w+){0,2}", re.ASCII)
_TEXTS = ("string", "wstring")
_MOST = (1 << 32) - 1
_ELSEWHERE = {
    "time": "builtin_interfaces/Time",
    "duration": "builtin_interfaces/Duration",
    "int": "int32 or int64",
    "uint": "uint32 or uint64",
    "float": "float32 or float64",
    "double": "float64",
    "str": "string",
    "boolean": "bool",
    "bytes": "uint8[]",
    "long": "int64",
    "short": "int16",
}
"""Words of ROS 1 and of other languages, and ROS 2's."""


class UnreadableType(Exception):
    """The text of a type is wrong; `start` and `end` say which part of it."""

    def __init__(self, reason: str, start: int, end: int, fix: str | None = None) -> None:
        super().__init__(reason)
        self.reason: str = reason
        self.start: int = start
        self.end: int = end
        self.fix: str | None = fix


def read_type(text: str, package: str, *, lenient: bool = False) -> Field:
    """Return a field of the type, still without a name.

    >>> read_type("Pose[3]", "my_msgs").base
    'my_msgs/msg/Pose'

    Raises:
        UnreadableType: There is no such type.
    """
    shape = next(_SHAPE.finditer(text))  # every text has this shape
    base = shape["base"]
    nested = base not in PRIMITIVES
    if nested:
        base = _full_name(base, package, lenient=lenient)
    bound = _bound(shape["bound"], shape.start("bound"), base, nested=nested)
    count, size = _array(shape["array"], shape.start("array"))
    return Field("", base, nested, count, size, bound)


def short_name(name: str) -> str:
    """Return `std_msgs/msg/Header` as `std_msgs/Header`, the form that every reader of definitions knows."""
    parts = name.split("/")
    return f"{parts[0]}/{parts[2]}" if len(parts) == 3 and parts[1] == "msg" else name


def full_name(name: str, package: str) -> str:
    """Return the full name of a message that a definition of `package` names."""
    parts = name.split("/")
    if len(parts) == 1:
        return f"{package}/msg/{name}"
    return f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else name


def _full_name(word: str, package: str, *, lenient: bool) -> str:
    if lenient:
        if not _ANY.fullmatch(word):
            raise UnreadableType(f"{quoted(word)} is no type", 0, max(1, len(word)))
        return "std_msgs/msg/Header" if word == "Header" else full_name(word, package)
    if word in _ELSEWHERE:
        raise UnreadableType(f"ROS 2 has no type {word}", 0, len(word), f"write {_ELSEWHERE[word]}")
    parts = word.split("/")
    if len(parts) > 3 or (len(parts) == 3 and parts[1] != "msg"):
        fix = "a comment begins with #" if word.startswith("/") else "write package/Type"
        raise UnreadableType(f"{quoted(word)} names no message", 0, len(word), fix)
    if len(parts) > 1 and not _PACKAGE.fullmatch(parts[0]):
        rule = "a letter, then lower case, digits, single underscores"
        raise UnreadableType(f"{quoted(parts[0])} is no name of a package: {rule}", 0, max(1, len(parts[0])))
    if not _TYPE.fullmatch(parts[-1]):
        start = len(word) - len(parts[-1])
        guess = (nearest(word, PRIMITIVES) if len(parts) == 1 else None) or _as_written(word)
        fix = f"did you mean {guess!r}?" if guess else None
        message = f"there is no type {quoted(word)}: a message is named in letters and digits, a capital first"
        raise UnreadableType(message, min(start, max(0, len(word) - 1)), max(1, len(word)), fix)
    return full_name(word, package)


def _as_written(word: str) -> str | None:
    """Return the name of a message as a definition has it: `geometry_msgs.Point` is `geometry_msgs/Point`."""
    *package, last = [each for each in re.split(r"\W+", word) if each != "msg"] or [word]
    name = "/".join([*package, "".join(each[:1].upper() + each[1:] for each in last.split("_"))])
    return name if len(package) < 2 and _TYPE.fullmatch(name.rpartition("/")[2]) else None


def _bound(text: str | None, start: int, base: str, *, nested: bool) -> int:
    if text is None:
        return 0
    found = _BOUND.fullmatch(text)
    end = start + len(text)
    if nested or base not in _TEXTS:
        size = text.removeprefix("<").removeprefix("=") or "5"
        raise UnreadableType(
            f"{base} has no bound; a text and an array have one", start, end, f"write [<={size}] for an array"
        )
    if found is None or not 0 < int(found[1]) <= _MOST:
        raise UnreadableType(f"{quoted(text)} is no bound", start, end, f"write a number: {base}<=10")
    return int(found[1])


def _array(text: str | None, start: int) -> tuple[Count, int]:
    if text is None:
        return Count.ONE, 0
    end = start + len(text)
    found = _ARRAY.fullmatch(text)
    if found is None:
        if not text.endswith("]"):
            raise UnreadableType("this bracket is not closed", start, end, "write [], [3] or [<=3]")
        if text.count("[") > 1:
            fix = "put the inner array into a message of its own"
            raise UnreadableType("ROS 2 has no arrays of arrays", start + text.index("[", 1), end, fix)
        raise UnreadableType(
            f"{quoted(text[1:-1])} is no length of an array", start + 1, end - 1, "write [], [3] or [<=3]"
        )
    if not found[2]:
        if found[1]:
            raise UnreadableType("a bound needs a number", start + 1, end - 1, "write [<=3], or [] for any number")
        return Count.UNBOUNDED, 0
    if not 0 < int(found[2]) <= _MOST:
        raise UnreadableType(f"an array has 1 to {_MOST} values", start + 1, end - 1)
    return Count.BOUNDED if found[1] else Count.FIXED, int(found[2])
