"""Reads YAML into a `Value`: from the event stream, within limits, with the place of every value.

Only data is accepted: no aliases, anchors, second documents, or keys that are not scalars.
A scalar may have a tag for its type, e.g. `!!str 0483`.
Plain scalars follow YAML 1.2's core schema: `yes`, `on` and `12:30` are text, and `010` is ten.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

import yaml

from busflow.errors import LaunchError, Place, Problem
from busflow.launchfile.yaml.scalar import event_scalar, is_known_tag, plain_scalar
from busflow.launchfile.yaml.syntax import explain
from busflow.launchfile.yaml.value import Origin, Scalar, StatedBy, Value

MAX_BYTES = 1 << 20
MAX_BYTES_WITHOUT_LIBYAML = 128 << 10
"""The pure parser takes seconds per MiB."""
MAX_DEPTH = 64
MAX_VALUES = 50_000
MAX_PROBLEMS = 20

_LINE_END = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
_UNREADABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x84\x86-\x9f\ud800-\udfff\ufffe\uffff]")
_BYTE_ORDER_MARKS = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16", b"\x00\x00\xfe\xff": "UTF-32"}


Repeated: TypeAlias = list[tuple[str, Value, Value]]
"""Repeated keys of mappings: each with its first value, which is used, and a further one."""


@dataclass(slots=True)
class Limits:
    """Number of values that may still be read, shared by all files of a launch."""

    values: int = MAX_VALUES


def read_file(
    path: Path,
    shown: str,
    included_from: tuple[Place, ...] = (),
    limits: Limits | None = None,
    repeated: Repeated | None = None,
) -> Value:
    """Return the content of a YAML file.

    Args:
        path: The file.
        shown: The name of the file in errors: the path as the user wrote it.
        included_from: The `include` entries that led here, innermost first.
        limits: The remaining limits of the launch.
        repeated: Receives repeated keys; without it they are an error.

    Raises:
        LaunchError: The file cannot be read, or holds something that this module does not accept.
    """
    try:
        raw = _bytes(path)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _refusal("unreadable-file", f"cannot read {shown}: {reason}", None, None, included_from) from None
    return parse(raw, shown, included_from, limits, repeated=repeated)


def parse(
    raw: bytes,
    file: str,
    included_from: tuple[Place, ...] = (),
    limits: Limits | None = None,
    loader: Any = None,
    repeated: Repeated | None = None,
) -> Value:
    """Return the only document of a YAML text.

    Raises:
        LaunchError: With every problem up to the first that makes the rest unreadable.
    """
    loader = loader or getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    limit = MAX_BYTES if loader is not yaml.SafeLoader else MAX_BYTES_WITHOUT_LIBYAML
    if len(raw) > limit:
        why = "" if limit == MAX_BYTES else ", because PyYAML was built without libyaml here"
        message = f"the file is larger than {limit >> 10} KiB{why}"
        fix = "split it with `include:` or `parameters_from:`"
        raise _refusal("file-too-large", message, fix, Place(file, 1, 1), included_from)
    text = _decoded(raw, file, included_from)
    builder = _Builder(_LINE_END.split(text), file, StatedBy.FILE, included_from, limits or Limits(), repeated)
    return builder.build(text, loader)


def parse_value(text: str, label: str, before: str = "", *, as_text: bool = False) -> Value:
    """Return a value from a command line: a scalar, or a list or mapping in flow style.

    A value that is not YAML is text, so that no shell quoting has to be quoted again.

    >>> parse_value("[1, 2.5, on]", "command line").data
    [1, 2.5, 'on']
    >>> parse_value("@home", "command line").data
    '@home'

    Args:
        text: The value.
        label: The name of the place in errors.
        before: The text before the value on the line, for the excerpt.
        as_text: Always read the value as text.

    Raises:
        LaunchError: The value begins a quote, a list or a mapping but is not valid.
    """
    builder = _Builder([before + text], label, StatedBy.COMMAND_LINE, shift=len(before))
    bad = _UNREADABLE.search(text)
    if bad is not None:
        place = Place(label, 1, len(before) + bad.start() + 1, 1, before + text)
        raise _refusal("control-character", f"the value holds {_named(bad.group())}", "leave it out", place)
    if text[:1] in {"[", "{", '"', "'"} and not as_text:
        return builder.build(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    place = Place(label, 1, len(before) + 1, max(1, len(text)), before + text)
    content = builder.scalar(text.strip(), place) if not as_text else text
    builder.finish()
    return Value(text if content is None or isinstance(content, str) else content, Origin(StatedBy.COMMAND_LINE, place))


@dataclass(slots=True)
class _Builder:
    """Builds values from YAML's events and counts them."""

    lines: list[str]
    file: str
    source: StatedBy
    included_from: tuple[Place, ...] = ()
    limits: Limits = field(default_factory=Limits)
    repeated: Repeated | None = None
    shift: int = 0
    """Column at which the text begins on its first line."""
    problems: list[Problem] = field(default_factory=list[Problem])
    repeats: list[Problem] = field(default_factory=list[Problem])
    """Certainly repeated keys, reported with `problems` if there are any: then no later check sees the whole."""

    def build(self, text: str, loader: Any) -> Value:
        """Return the only document of `text`."""
        events = event_stream(text, loader)
        root: Value | None = None
        try:
            for event in events:
                if isinstance(event, yaml.NodeEvent):
                    root = self._node(event, events, 0, None)
                elif isinstance(event, yaml.DocumentStartEvent) and root is not None:
                    self._refuse("several-documents", "a second document begins here", "use one file for each", event)
                    break
        except yaml.MarkedYAMLError as error:
            if "nesting depth" in str(error.problem) and loader is not yaml.SafeLoader:
                return self.build(text, yaml.SafeLoader)  # libyaml gives up before its first event
            self.problems.append(explain(error, text, self._place))
        except (yaml.YAMLError, ValueError, OverflowError) as error:
            # In the pure parser, chr() raises for an escape beyond Unicode.
            self.problems.append(Problem("yaml", f"not valid YAML: {error}", None, self._place(0, 0, 1)))
        self.finish()
        if root is None or root.content is None:
            self._stop(Problem("empty-file", "the file is empty", "write `key: value` lines", Place(self.file, 1, 1)))
        return root

    def finish(self) -> None:
        """Raise the problems found, if any."""
        if self.problems:
            found = [*self.problems, *self.repeats][:MAX_PROBLEMS]
            raise LaunchError([_included(problem, self.included_from) for problem in found])

    def scalar(self, text: str, place: Place) -> Scalar:
        """Return the value of a plain scalar; keep a problem if the number is too large."""
        try:
            return plain_scalar(text)
        except ValueError as error:
            fix = "quote it if it is text; a larger number needs a float such as 1.0e+20"
            self.problems.append(Problem("number-too-large", str(error), fix, place))
            return None

    def _scalar_of(self, event: Any, place: Place) -> Scalar:
        """Return the value of a scalar; keep a problem if it is not of the type that its tag states."""
        if event.tag is None:
            return self.scalar(event.value, place) if event.implicit[0] and not event.style else event.value
        try:
            return event_scalar(event) if is_known_tag(event.tag) else None
        except ValueError as error:
            self.problems.append(Problem("tag", str(error), "leave the tag out, or write a value of its type", place))
            return None

    def _node(self, event: Any, events: Iterator[Any], depth: int, key: Place | None) -> Value:
        self.limits.values -= 1
        place = self._place_of(event)
        if self.limits.values < 0:
            fix = "keep large data in a file that the node itself reads"
            self._stop(Problem("too-many-values", f"a launch has at most {MAX_VALUES} values", fix, place))
        if depth > MAX_DEPTH:
            self._stop(Problem("nested-too-deep", f"nested deeper than {MAX_DEPTH} levels", "make it flatter", place))
        self._check_plain(event, may_have_tag=isinstance(event, yaml.ScalarEvent))
        content: Any = None
        if isinstance(event, yaml.ScalarEvent):
            content = self._scalar_of(event, place)
        elif isinstance(event, yaml.SequenceStartEvent):
            content = []
            while not isinstance(item := next(events), yaml.SequenceEndEvent):
                content.append(self._node(item, events, depth + 1, None))
        elif isinstance(event, yaml.MappingStartEvent):
            content = self._members(events, depth)
        return Value(content, Origin(self.source, place, self.included_from), key)

    def _members(self, events: Iterator[Any], depth: int) -> dict[str, Value]:
        members: dict[str, Value] = {}
        while not isinstance(item := next(events), yaml.MappingEndEvent):
            if not isinstance(item, yaml.ScalarEvent):
                self._refuse("key-not-scalar", "a key must be a plain word or text", "quote it if it is text", item)
                self._node(item, events, depth + 1, None)
                self._node(next(events), events, depth + 1, None)
                continue
            self._check_plain(item)
            name: str = item.value
            place = self._place_of(item)
            following = next(events)
            if name == "<<" and not item.style:
                self._refuse("merge-key", "merge keys (<<) are not allowed", "write the merged keys here instead", item)
                if isinstance(following, yaml.AliasEvent):
                    continue  # the advice for an alias would lead back here
            value = self._node(following, events, depth + 1, place)
            if members.setdefault(name, value) is not value:
                self._repeat(members, name, value)
        return members

    def _repeat(self, members: dict[str, Value], name: str, second: Value) -> None:
        """Keep a repeated key, as `repeated` or as a problem."""
        problem = duplicate_key(name, members[name], second)
        if self.repeated is None:
            self._keep(problem)
            return
        self.repeated.append((name, members[name], second))
        # With an empty key in the mapping, the repeated one may belong below that.
        if all(each.content is not None or key == name for key, each in members.items()):
            self.repeats.append(problem)

    def _check_plain(self, event: Any, *, may_have_tag: bool = False) -> None:
        """Refuse YAML features beyond plain data; a value may state its type."""
        if isinstance(event, yaml.AliasEvent):
            self._refuse("alias", f"aliases such as *{event.anchor} are not allowed", "write the value again", event)
        elif event.anchor is not None:
            self._refuse("anchor", f"anchors such as &{event.anchor} are not allowed", "leave it out", event)
        elif event.tag is not None and not (may_have_tag and is_known_tag(event.tag)):
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            self._refuse("tag", f"tags such as {tag} are not allowed", "leave it out; quote a text", event)
        elif isinstance(event, yaml.ScalarEvent) and event.style and _has_surrogate(event.value):
            self._refuse("escape", "half of a surrogate pair is not a character", r"write \UXXXXXXXX", event)

    def _refuse(self, code: str, message: str, fix: str, event: Any) -> None:
        self._keep(Problem(code, message, fix, self._place_of(event)))

    def _keep(self, problem: Problem) -> None:
        self.problems.append(problem)
        if len(self.problems) >= MAX_PROBLEMS:
            self.finish()

    def _stop(self, problem: Problem) -> NoReturn:
        self.problems.append(problem)
        self.finish()
        raise AssertionError  # finish has raised the problem

    def _place_of(self, event: Any) -> Place:
        start, end = event.start_mark, event.end_mark
        width = end.column - start.column if end.line == start.line else None
        if isinstance(event, (yaml.MappingStartEvent, yaml.SequenceStartEvent)) and not event.flow_style:
            width = None
        return self._place(start.line, start.column, width)

    def _place(self, line: int, column: int, width: int | None = None) -> Place:
        """Return the place of a part of a line. All numbers count from 0; without a width it ends with the line."""
        excerpt = self.lines[line] if line < len(self.lines) else ""
        shift = self.shift if line == 0 else 0
        if width is None:
            width = len(excerpt.rstrip()) - column - shift
        return Place(self.file, line + 1, column + shift + 1, max(1, width), excerpt)


def duplicate_key(name: str, first: Value, second: Value) -> Problem:
    """Return the problem of a repeated key."""
    message = f"the key {name} stands twice; it was first at {first.key}"
    return Problem(
        "duplicate-key", message, "leave one of them out", second.key, included_from=second.origin.included_from
    )


def event_stream(text: str, loader: Any = None) -> Iterator[Any]:
    """Return YAML's events, each with its position in the text.

    Raises:
        yaml.MarkedYAMLError: During iteration, if the text is not YAML.
    """
    loader = loader or getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    return yaml.parse(text, Loader=loader)  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]  # a stub without types


def _bytes(path: Path) -> bytes:
    """Return a file's content, at most one byte more than the limit, which shows that it is too large."""
    # Open without blocking and check the type before reading: a FIFO would block for ever, a device never end.
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0))
    with os.fdopen(descriptor, "rb") as file:
        mode = os.fstat(descriptor).st_mode
        if not stat.S_ISREG(mode):
            raise ValueError("it is a directory" if stat.S_ISDIR(mode) else "it is not a regular file")
        return file.read(MAX_BYTES + 1)


def _decoded(raw: bytes, file: str, included_from: tuple[Place, ...]) -> str:
    """Decode a UTF-8 file, with or without a byte order mark."""
    for mark, encoding in _BYTE_ORDER_MARKS.items():
        if raw.startswith(mark):
            message = f"the file is written in {encoding}"
            raise _refusal("not-utf-8", message, "save it as UTF-8", Place(file, 1, 1), included_from)
    raw = raw.removeprefix(b"\xef\xbb\xbf")
    try:
        text = raw.decode()
    except UnicodeDecodeError as error:
        before = raw[: error.start].decode()
        place = _place_in(before + raw[error.start :].decode(errors="replace"), len(before), file)
        message = f"the byte 0x{raw[error.start]:02x} is not UTF-8"
        raise _refusal("not-utf-8", message, "save the file as UTF-8", place, included_from) from None
    bad = _UNREADABLE.search(text)
    if bad is not None:
        message = f"{_named(bad.group())} is not allowed; is this a text file?"
        raise _refusal("control-character", message, "leave it out", _place_in(text, bad.start(), file), included_from)
    return text


def _place_in(text: str, index: int, file: str) -> Place:
    lines = _LINE_END.split(text[:index])
    rest = _LINE_END.split(text[index : index + 200])[0]
    return Place(file, len(lines), len(lines[-1]) + 1, 1, lines[-1] + rest)


def _named(char: str) -> str:
    return "a NUL byte" if char == "\0" else f"the control character U+{ord(char):04X}"


def _has_surrogate(text: str) -> bool:
    return any("\ud800" <= char <= "\udfff" for char in text)


def _included(problem: Problem, included_from: tuple[Place, ...]) -> Problem:
    return Problem(problem.code, problem.message, problem.fix, problem.place, problem.severity, included_from)


def _refusal(
    code: str, message: str, fix: str | None, place: Place | None, included_from: tuple[Place, ...] = ()
) -> LaunchError:
    return LaunchError([Problem(code, message, fix, place, included_from=included_from)])
