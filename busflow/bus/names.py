"""Names of topics, nodes and namespaces: ROS 2's grammar, expansion, remapping. Pure functions on text."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from typing import NoReturn

from busflow.errors import InvalidName
from busflow.text import did_you_mean, printable

TOPIC_NAME_MAX = 247
"""ROS 2 keeps 8 of 255 characters for prefixes of its own."""
NAMESPACE_MAX = TOPIC_NAME_MAX - 2
NODE_NAME_MAX = 255

_WORD = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_")
_DIGITS = frozenset("0123456789")

_FAULTS = {
    "empty": "it is empty; give it a name",
    "not_absolute": "it is not absolute; start it with '/'",
    "ends_with_slash": "it ends with '/'; leave that out",
    "repeated_slash": "two slashes follow each other; leave one out",
    "unallowed_characters": "{char!r} is not allowed; use ASCII letters, digits, '_'{more}",
    "starts_with_number": "it starts with a digit; start it with a letter or '_'",
    "token_starts_with_number": "a part of it starts with a digit; start each part with a letter or '_'",
    "misplaced_tilde": "'~' is the node itself and can only come first; move it there or leave it out",
    "tilde_not_followed_by_slash": "'/' is missing after '~'; write '~/' before the rest",
    "unmatched_brace": "this brace has no partner; write a substitution as {{node}}, {{ns}} or {{namespace}}",
    "substitution_unallowed_characters": "{char!r} is not allowed between braces; use letters, digits, '_'",
    "substitution_starts_with_number": "a substitution starts with a digit; start it with a letter or '_'",
    "unknown_substitution": "nothing is known by the name between these braces; {more}",
    "too_long": "it has {length} characters of at most {more}; shorten it",
}


@dataclass(frozen=True, slots=True)
class NameFault:
    """A fault of a name: a stable word, the index of the character, and the reason with a fix."""

    kind: str
    index: int
    message: str


def topic_name_fault(name: str) -> NameFault | None:
    """Return the fault of a topic name as a node writes it, if any: `relative`, `~/private`, `{node}/x`, `/absolute`.

    >>> topic_name_fault("foo/~/bar").kind
    'misplaced_tilde'
    """
    if not name:
        return _fault(name, "empty", 0)
    if name[0] in _DIGITS:
        return _fault(name, "token_starts_with_number", 0)
    if name[-1] == "/":
        return _fault(name, "ends_with_slash", len(name) - 1)
    return _substitution_fault(name) or _tilde_fault(name) or _token_fault(name)


def full_topic_name_fault(name: str) -> NameFault | None:
    """Return the fault of a topic name that must be absolute, without `~` and `{}`, if any."""
    return _absolute_name_fault(name) or _length_fault(name, TOPIC_NAME_MAX)


def namespace_fault(name: str) -> NameFault | None:
    """Return the fault of a namespace, if any; valid are `/` and absolute names."""
    if name == "/":
        return None
    return _absolute_name_fault(name) or _length_fault(name, NAMESPACE_MAX)


def node_name_fault(name: str) -> NameFault | None:
    """Return the fault of a node name, if any; valid is one word without slashes."""
    if not name:
        return _fault(name, "empty", 0)
    for index, char in enumerate(name):
        if char not in _WORD:
            return _fault(name, "unallowed_characters", index)
    if name[0] in _DIGITS:
        return _fault(name, "starts_with_number", 0)
    return _length_fault(name, NODE_NAME_MAX)


def check_topic_name(name: str) -> str:
    """Return the name, or raise `InvalidName`, which shows the place of the fault."""
    return _check("topic name", name, topic_name_fault)


def check_full_topic_name(name: str) -> str:
    """Return the name, or raise `InvalidName`."""
    return _check("topic name", name, full_topic_name_fault)


def check_namespace(name: str) -> str:
    """Return the namespace, or raise `InvalidName`."""
    return _check("namespace", name, namespace_fault)


def check_node_name(name: str) -> str:
    """Return the node's name, or raise `InvalidName`."""
    return _check("node name", name, node_name_fault)


def is_hidden(name: str) -> bool:
    """Return whether a part of the name starts with `_`; listings omit such names by default.

    >>> is_hidden("/_busflow_cli_7"), is_hidden("/left/imu_data")
    (True, False)
    """
    return any(part.startswith("_") for part in name.split("/"))


def absolute_name(name: str) -> str:
    """Return a name with the leading slash that a user may leave out; `""` is the root namespace.

    >>> absolute_name("left/arm"), absolute_name("/imu")
    ('/left/arm', '/imu')
    """
    return name if name.startswith("/") else f"/{name}"


@lru_cache(maxsize=1024)  # used for every line of a ledger and every failure
def fully_qualified(node: str, namespace: str) -> str:
    """Return a node's unique name in the graph.

    >>> fully_qualified("camera", "/left"), fully_qualified("camera", "")
    ('/left/camera', '/camera')
    """
    check_node_name(node)
    namespace = check_namespace(absolute_name(namespace))
    return _join(namespace, node)


def expand(name: str, *, node: str, namespace: str, substitutions: Mapping[str, str] | None = None) -> str:
    """Return the absolute name of a topic or service that a node writes as `name`.

    As in ROS 2, substituted text is not checked again: `/foo/{ns}` has two slashes in a row afterwards, which
    `resolve` refuses.

    >>> expand("~/image", node="camera", namespace="/left")
    '/left/camera/image'

    Raises:
        InvalidName: The name, the node's name or the namespace is not one, or a substitution is unknown.
    """
    check_topic_name(name)
    check_node_name(node)
    check_namespace(namespace)
    known = {**(substitutions or {}), "node": node, "ns": namespace, "namespace": namespace}

    def replace(match: re.Match[str]) -> str:
        if match[1] not in known:
            more = did_you_mean(match[1], known)
            _refuse("topic name", name, _fault(name, "unknown_substitution", name.index(match[0]), more))
        return known[match[1]]

    full = _join(namespace, node) + name[1:] if name[0] == "~" else name
    full = re.sub(r"\{([^}]*)\}", replace, full)
    return full if full.startswith("/") else _join(namespace, full)


class Target(StrEnum):
    """The kind of name that a remap rule renames."""

    NODE = "node"
    NAMESPACE = "namespace"
    NAME = "name"
    """Topics and services alike."""
    TOPIC = "topic"
    SERVICE = "service"


# The parts of a name in ROS 2's rule syntax: no two underscores in a row, which begin `__node` and `__ns`.
_PART = r"(?:[A-Za-z]|_(?!_))(?:[A-Za-z0-9]|(?<!_)_)*"
_RESOURCE = rf"(?:~/|/)?{_PART}(?:/{_PART})*"
_REMAP_RULE = re.compile(
    rf"(?P<key>(?:(?P<node>{_PART}):)?(?:(?P<scheme>rostopic://|rosservice://)?(?P<match>{_RESOURCE})"
    rf"|(?P<special>__node|__name|__ns))):=(?P<replacement>.+)",
)
_NAMESPACE_VALUE = re.compile(rf"/(?:{_PART}(?:/{_PART})*/?)?")
_SCHEMES = {None: Target.NAME, "rostopic://": Target.TOPIC, "rosservice://": Target.SERVICE}
_SPECIALS = {
    "__node": (Target.NODE, re.compile(_PART)),
    "__name": (Target.NODE, re.compile(_PART)),
    "__ns": (Target.NAMESPACE, _NAMESPACE_VALUE),
}


@dataclass(frozen=True, slots=True)
class RemapRule:
    """A rule that renames topics or services that match, or (with `__node`, `__ns`) a node or its namespace.

    >>> RemapRule.parse("camera:image:=image_raw").replacement
    'image_raw'
    """

    key: str
    """The left side as it was written, which reports use to name the rule."""
    match: str
    replacement: str
    target: Target = Target.NAME
    node: str | None = None
    """The only node the rule is for; None is all."""

    @classmethod
    def parse(cls, text: str) -> RemapRule:
        """Parse a rule in ROS 2's syntax: `[node:][rostopic://]match:=replacement`.

        Raises:
            InvalidName: The text is not such a rule.
        """
        found = _REMAP_RULE.fullmatch(text)
        if found is not None:
            target, value = _SCHEMES[found["scheme"]], re.compile(_RESOURCE)
            if found["special"]:
                target, value = _SPECIALS[found["special"]]
            if value.fullmatch(found["replacement"]):
                return cls(found["key"], found["match"] or "", found["replacement"], target, found["node"])
        raise InvalidName(
            f"remap rule {printable(text, limit=300)!r} is not one; write it as 'from:=to', 'node:from:=to', "
            "'__node:=name' or '__ns:=/namespace', with names of letters, digits, single '_' and '/'"
        )

    def applies(self, target: Target, *, node: str, namespace: str, name: str) -> bool:
        """Return whether the rule renames this topic, service (both by absolute name), node or namespace."""
        if self.node is not None and self.node != node:
            return False
        if target in (Target.NODE, Target.NAMESPACE):
            return self.target is target
        if self.target not in (Target.NAME, target):
            return False
        return expand(self.match, node=node, namespace=namespace) == name


def remap(
    target: Target, rules: Iterable[RemapRule], *, node: str, namespace: str = "/", name: str = ""
) -> RemapRule | None:
    """Return the first rule that renames the target, if any. Local rules come before global ones."""
    return next((rule for rule in rules if rule.applies(target, node=node, namespace=namespace, name=name)), None)


@dataclass(frozen=True, slots=True)
class Resolved:
    """A topic's final name, and the key of the remap rule that applied, if any."""

    name: str
    rule: str | None = None


def resolve(
    name: str,
    *,
    node: str,
    namespace: str,
    remaps: Mapping[str, str] | Sequence[RemapRule] = (),
    service: bool = False,
) -> Resolved:
    """Return the final name of a topic or service: expanded, then renamed once, by the first rule that matches.

    Both sides of a rule are expanded for the node, so a relative rule reaches only names beside the node.

    >>> resolve("imu", node="head", namespace="/left", remaps={"imu": "/imu"})
    Resolved(name='/imu', rule='imu')

    Raises:
        InvalidName: The name, a rule, or the result is not a valid name.
    """
    rules = [_rule(*item) for item in remaps.items()] if isinstance(remaps, Mapping) else remaps
    final = expand(name, node=node, namespace=namespace)
    target = Target.SERVICE if service else Target.TOPIC
    rule = remap(target, rules, node=node, namespace=namespace, name=final)
    if rule is not None:
        final = expand(rule.replacement, node=node, namespace=namespace)
    return Resolved(check_full_topic_name(final), rule.key if rule else None)


def _rule(match: str, replacement: str) -> RemapRule:
    """Create the rule of a launch file's remap entry, which, unlike ROS 2's syntax, may rename any topic name."""
    return RemapRule(match, check_topic_name(match), check_topic_name(replacement))


def _join(namespace: str, name: str) -> str:
    return f"/{name}" if namespace == "/" else f"{namespace}/{name}"


def _substitution_fault(name: str) -> NameFault | None:
    """Return the first wrong character or unmatched brace."""
    opened: int | None = None
    for index, char in enumerate(name):
        if char == "~":
            if index:
                return _fault(name, "misplaced_tilde", index)
        elif char == "}":
            if opened is None:
                return _fault(name, "unmatched_brace", index)
            opened = None
        elif opened is not None:
            if char not in _WORD:
                return _fault(name, "substitution_unallowed_characters", index)
            if char in _DIGITS and index == opened + 1:
                return _fault(name, "substitution_starts_with_number", index)
        elif char == "{":
            opened = index
        elif char not in _WORD and char != "/":
            return _fault(name, "unallowed_characters", index, ", '/', a leading '~' and {substitutions}")
    return None if opened is None else _fault(name, "unmatched_brace", opened)


def _tilde_fault(name: str) -> NameFault | None:
    """Return a `~` without a slash after it; ROS 2 overlooks this in a name of two characters."""
    wrong = name[0] == "~" and len(name) > 1 and name[1] != "/"
    return _fault(name, "tilde_not_followed_by_slash", 1) if wrong else None


def _token_fault(name: str) -> NameFault | None:
    found = re.search("/([0-9])", name)
    return _fault(name, "token_starts_with_number", found.start(1)) if found else None


def _absolute_name_fault(name: str) -> NameFault | None:
    if not name:
        return _fault(name, "empty", 0)
    if name[0] != "/":
        return _fault(name, "not_absolute", 0)
    if name[-1] == "/":
        return _fault(name, "ends_with_slash", len(name) - 1)
    for index, char in enumerate(name):
        if char not in _WORD and char != "/":
            return _fault(name, "unallowed_characters", index, " and '/'")
    repeated = name.find("//") + 1
    numbered = _token_fault(name)
    if repeated and (numbered is None or repeated < numbered.index):
        return _fault(name, "repeated_slash", repeated)
    return numbered


def _length_fault(name: str, limit: int) -> NameFault | None:
    """Return the fault of a name that is too long; checked last, as in ROS 2."""
    return _fault(name, "too_long", limit - 1, str(limit)) if len(name) > limit else None


def _fault(name: str, kind: str, index: int, more: str = "") -> NameFault:
    return NameFault(kind, index, _FAULTS[kind].format(char=name[index : index + 1], more=more, length=len(name)))


@lru_cache(maxsize=1024)  # endpoints use the same few names at each start
def _check(what: str, name: str, find: Callable[[str], NameFault | None]) -> str:
    if (fault := find(name)) is not None:
        _refuse(what, name, fault)
    return name


def _refuse(what: str, name: str, fault: NameFault) -> NoReturn:
    """Raise `InvalidName` with the part of the name around the fault and a caret under it."""
    start = max(0, fault.index - 60)
    before, shown = printable(name[start : fault.index]), printable(name[start : start + 120])
    message = f"{what} {printable(name, limit=300)!r}: {fault.message}"
    raise InvalidName(f"{message}\n  {shown}\n  {' ' * len(before)}^")
