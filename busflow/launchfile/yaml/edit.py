"""Edits a launch file in place: replaces or adds one value and keeps everything else as it was written."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias, cast

import yaml

from busflow.errors import KeyPath, LaunchError, Problem
from busflow.launchfile.yaml.document import event_stream, parse
from busflow.launchfile.yaml.scalar import event_scalar, flow, written
from busflow.launchfile.yaml.value import Value
from busflow.validation.faults import dotted, same

Data: TypeAlias = Any
"""Plain data: scalars, lists and mappings."""

_LINE_END = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
_COMMENT = re.compile(r"[ \t]+#[^\r\n\x85\u2028\u2029]*")
_BYTE_ORDER_MARK = "\ufeff"


def edit(text: str, path: KeyPath, value: object) -> str:
    r"""Return the text of a launch file with another value at `path`.

    Comments, order, quotes and line ends stay, also inside a list or mapping that changes only in part. A new entry is
    added after its neighbours. Read the file with `newline=""` to keep its line ends.

    >>> print(edit("nodes:\n  imu:  # the new one\n    rate: 10  # Hz\n", ("nodes", "imu", "rate"), 20.0), end="")
    nodes:
      imu:  # the new one
        rate: 20.0  # Hz

    Raises:
        LaunchError: The text is no launch file, or the value has no place in it, such as below a number.
    """
    mark = _BYTE_ORDER_MARK * text.startswith(_BYTE_ORDER_MARK)
    text = text.removeprefix(_BYTE_ORDER_MARK)
    before = parse(text.encode(errors="surrogatepass"), dotted(path))
    path = _possible(before, tuple(map(str, path)))
    value = Value.of(value, before.origin).data
    wanted = before.with_member(path, Value.of(_escaped(value), before.origin)).data
    for whole in (False, True):
        editor = _Editor(text, _tree(text))
        editor.put(editor.root, path, value, whole=whole)
        edited = editor.edited()
        if _loads_as(edited, wanted):
            return mark + edited
    raise _refusal(path, "this value cannot be written there", "write it by hand")


@dataclass(slots=True)
class _Node:
    """A value in the text: its start, its end, and its style."""

    data: Data
    start: int
    end: int
    """Its end, before any comment."""
    column: int
    style: str = ""
    """Its first character: a quote, `|`, `>`, or `{` for any bracket; empty for plain and block style."""
    key_end: int | None = None
    """End of its key, as a member of a mapping."""
    members: dict[str, _Node] = field(default_factory=dict["str", "_Node"])
    items: list[_Node] = field(default_factory=list["_Node"])

    @property
    def is_empty(self) -> bool:
        """Whether the value has no text, which means null."""
        return self.start == self.end


def _tree(text: str) -> _Node:
    stream = event_stream(text)
    first = next(each for each in stream if not isinstance(each, (yaml.StreamStartEvent, yaml.DocumentStartEvent)))
    return _node(first, stream)


def _node(event: Any, stream: Iterator[Any], key_end: int | None = None) -> _Node:
    start, column, end = event.start_mark.index, event.start_mark.column, event.end_mark.index
    if isinstance(event, yaml.ScalarEvent):
        style = event.style or ""
        return _Node(event_scalar(event), start, end, column, style, key_end)
    node = _Node(None, start, end, column, "{" if event.flow_style else "", key_end)
    if isinstance(event, yaml.SequenceStartEvent):
        while not isinstance(item := next(stream), yaml.SequenceEndEvent):
            node.items.append(_node(item, stream))
        node.data = [each.data for each in node.items]
        last = node.items[-1:]
    else:
        while not isinstance(item := next(stream), yaml.MappingEndEvent):
            node.members[item.value] = _node(next(stream), stream, item.end_mark.index)
        node.data = {key: each.data for key, each in node.members.items()}
        last = list(node.members.values())[-1:]
    # YAML ends a block collection at the start of the next value, after blank lines and comments.
    node.end = item.end_mark.index if node.style else max((each.end for each in last), default=end)
    return node


class _Editor:
    """Collects the replacements in a text."""

    def __init__(self, text: str, root: _Node) -> None:
        self.root = root
        self._text = text
        self._line_end = found.group() if (found := _LINE_END.search(text)) else "\n"
        self._splices: list[tuple[int, int, str]] = []

    def edited(self) -> str:
        """Return the text with all replacements made."""
        text = self._text
        for start, end, new in sorted(self._splices, reverse=True):
            text = text[:start] + new + text[end:]
        return text

    def put(self, node: _Node, path: KeyPath, value: Data, *, whole: bool) -> None:
        """Put a value at a path below `node`: replace all of it (`whole`), or only the parts that differ."""
        if not path:
            self._replace(node, value) if whole else self._change(node, value)
            return
        step = path[0]
        if isinstance(node.data, list):
            self.put(node.items[int(step)], path[1:], value, whole=whole)
        elif str(step) in node.members:
            self.put(node.members[str(step)], path[1:], value, whole=whole)
        else:
            for inner in reversed(path[1:]):
                value = {str(inner): value}
            self._add(node, str(step), value)

    def _change(self, node: _Node, value: Data) -> None:
        """Replace the parts that differ, and keep the rest as it is written."""
        if isinstance(value, dict) and node.members:
            members = cast("dict[str, Data]", value)
            for key, each in members.items():
                if key in node.members:
                    self._change(node.members[key], each)
                else:
                    self._add(node, key, each)
            for key in node.members.keys() - members.keys():
                self._delete(node.members[key])
        elif isinstance(value, list) and node.items:
            items = cast("list[Data]", value)
            for item, each in zip(node.items, items, strict=False):
                self._change(item, each)
            for each in items[len(node.items) :]:
                self._append(node, each)
            for item in node.items[len(items) :]:
                self._delete(item)
        elif not same(node.data, _escaped(value)):
            self._replace(node, value)

    def _replace(self, node: _Node, value: Data) -> None:
        new, start, end = flow(value), node.start, node.end
        if node.is_empty:
            if isinstance(value, dict) and value and node.key_end is not None and self._is_block(node):
                self._insert_lines(end, _block(cast("dict[str, Data]", value), self._indent_of(start) + 2))
                return
            has_colon = node.key_end is None or ":" in self._text[node.key_end : start]
            new = f"{'' if has_colon else ':'}{'' if self._text[start - 1] == ' ' else ' '}{new}"
        span = self._text[start:end]
        if node.style in {"|", ">"}:
            header = _COMMENT.search(span, 0, _LINE_END.search(span + "\n").start())  # type: ignore[union-attr]  # it ends
            new += header.group() if header else ""
        elif isinstance(node.data, dict | list) and not node.style:
            new = "  " + new  # indented deeper than its key in any case
        new += span[len(span.rstrip()) :]  # a block text ends after its last line end
        self._splices.append((start, end, new))

    def _add(self, node: _Node, key: str, value: Data) -> None:
        """Add a member after the others."""
        last = max(node.members.values(), key=lambda each: each.end, default=None)
        if node.is_empty:
            self._replace(node, {key: value})
        elif node.style:
            at = node.start + 1 if last is None else last.end
            self._splices.append((at, at, f"{', ' if last else ''}{written(key)}: {flow(value)}"))
        elif last is not None:
            self._insert_lines(last.end, _block({key: value}, node.column))

    def _append(self, node: _Node, value: Data) -> None:
        last = node.items[-1]
        if node.style:
            self._splices.append((last.end, last.end, f", {flow(value)}"))
        else:
            self._insert_lines(last.end, [f"{' ' * node.column}- {flow(value)}"])

    def _delete(self, node: _Node) -> None:
        """Delete the lines of a member or item. If others share these lines, `edit` replaces the whole instead."""
        at = node.start if node.key_end is None else node.key_end
        self._splices.append((self._line_start(at), self._next_line(node.end), ""))

    def _insert_lines(self, at: int, lines: Sequence[str]) -> None:
        """Insert lines after the line that ends at or after `at`."""
        at = at if at and _LINE_END.fullmatch(self._text[at - 1]) else self._next_line(at)
        block = "".join(line + self._line_end for line in lines)
        if at and not _LINE_END.fullmatch(self._text[at - 1]):  # the file's last line has no line end
            block = self._line_end + block.removesuffix(self._line_end)
        self._splices.append((at, at, block))

    def _next_line(self, at: int) -> int:
        found = _LINE_END.search(self._text, at)
        return found.end() if found else len(self._text)

    def _line_start(self, at: int) -> int:
        return max((found.end() for found in _LINE_END.finditer(self._text, 0, at)), default=0)

    def _indent_of(self, at: int) -> int:
        line = self._text[self._line_start(at) :]
        return len(line) - len(line.lstrip(" "))

    def _is_block(self, node: _Node) -> bool:
        """Return whether at most a comment follows on the line."""
        rest = self._text[node.end : self._next_line(node.end)].strip()
        return not rest or rest.startswith("#")


def _block(members: dict[str, Data], indent: int) -> list[str]:
    """Return the lines of a mapping in block style; lists stay on one line."""
    lines: list[str] = []
    for key, value in members.items():
        head = f"{' ' * indent}{written(key)}:"
        if isinstance(value, dict) and value:
            lines += [head, *_block(cast("dict[str, Data]", value), indent + 2)]
        else:
            lines.append(f"{head} {flow(value)}")
    return lines


def _escaped(value: Data) -> Data:
    """Escape `${` in texts as `$${`, so that it is no expression."""
    match value:
        case dict():
            return {key: _escaped(each) for key, each in cast("dict[str, Data]", value).items()}
        case list():
            return [_escaped(each) for each in cast("list[Data]", value)]
        case str():
            return value.replace("${", "$${")
        case _:
            return value


def _possible(tree: Value, path: KeyPath) -> KeyPath:
    """Return the path with list indices as numbers.

    Raises:
        LaunchError: An index is not in its list, or a step leads into a scalar.
    """
    steps, end = tree.followed(path)
    if end == len(path):
        return steps
    content = tree.nearest(steps[:end]).content
    if isinstance(content, list):
        raise _refusal(path, f"there is no {path[end]} in a list of {len(content)}", "set the whole list")
    raise _refusal(path, f"{flow(content)} stands where {path[end]} would belong", "write it by hand")


def _loads_as(text: str, wanted: Data) -> bool:
    try:
        return same(parse(text.encode(errors="surrogatepass"), "edited").data, wanted)
    except LaunchError:
        return False


def _refusal(path: KeyPath, message: str, fix: str) -> LaunchError:
    return LaunchError([Problem("not-editable", f"{dotted(path)}: {message}", fix)])
