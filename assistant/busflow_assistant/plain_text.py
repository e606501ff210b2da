"""Text as a browser's selection gives it → passages: code without fences or indentation, lists without bullets."""

from __future__ import annotations

import re
from collections.abc import Iterator

from busflow_assistant.passages import Extent, Page, Passage, PassageShape
from busflow_assistant.sentences import sentences, stripped

_PROSE = re.compile(r"^(?:[A-Z(\"'“*`]|\d+[.)] )[^{}=;]*[.!?:…][)\"'”’]*$")
_COMMANDS = (
    "sudo|cd|pip3?|python3?|ros2|colcon|source|export|git|mkdir|busflow|docker|apt|npm|rosdep|chmod|ls|cat|echo|touch"
    "|conda|uv"
)
_CODE = re.compile(
    "|".join(
        (
            r"from \S+ import ",
            r"(?:import \w|class \w+.*:$|(?:async )?def \w+\(|@\w+)",
            r"(?:return|raise|assert)\b",
            r"(?:elif .*|else|try|except\b.*):$",
            r"(?:if|for|while|with|async for|async with) .*:(?:\s*#.*)?$",
            r"(?:self\.|super\(\)|print\(|pass$|#|//|</?\w)",
            r"(?:\$ |>>> )",
            rf"(?:{_COMMANDS}) [^,;]*$",
            r"[\w.\[\]'\"]+(?: ?, ?[\w.\[\]]+)* ?[+*/-]?= ?\S",  # an assignment
            r"[\w.]+\(.*\)?[,;:]?(?:\s*#.*)?$",  # a call
            r"[)\]}]",
            r"[\w./-]+:(?: [^.]*)?$",  # YAML
            r"- \w+:",
        )
    )
)
_HEADING = re.compile(
    r"^(?:(?:Step|Lab|Chapter|Part|Exercise|Task|Section)\b.{0,80}|\d+(?:\.\d+)*\.? \S.{0,60}|[A-Z][\w' -]{2,50})$"
)


def read_text(name: str, source: str) -> Page:
    """Return plain text as a page with passages."""
    return Page(name, source, tuple(_passages(source)))


def _passages(source: str) -> Iterator[Passage]:
    headings: tuple[str, ...] = ()
    for shape, lines in _blocks(source):
        span = Extent(lines[0].start, lines[-1].end)
        if shape is PassageShape.HEADING:
            yield Passage(shape, span, (span,), headings[:1])
            headings = (*headings[:1], source[span.start : span.end])
        elif shape is PassageShape.PROSE:
            yield Passage(shape, span, tuple(each for line in lines for each in sentences(source, line)), headings)
        else:
            yield Passage(shape, span, tuple(lines), headings)


def _blocks(source: str) -> Iterator[tuple[PassageShape, list[Extent]]]:
    """Lines of one shape that follow each other; an empty line ends all but code."""
    shape, lines, apart = PassageShape.PROSE, list[Extent](), True
    for match in re.finditer(r"[^\r\n]*(?:\r\n|\n|\r|\Z)", source):
        line = stripped(source, Extent(*match.span()))
        if not line:
            apart = True
            continue
        now = _shape(source[line.start : line.end], in_code=shape is PassageShape.CODE and bool(lines) and not apart)
        if lines and (now is not shape or now is PassageShape.HEADING or (apart and now is not PassageShape.CODE)):
            yield shape, lines
            lines = []
        shape, apart = now, False
        lines.append(line)
    if lines:
        yield shape, lines


def _shape(line: str, *, in_code: bool) -> PassageShape:
    if (line.startswith("|") and line.count("|") > 2) or "\t" in line.strip():
        return PassageShape.TABLE
    if _CODE.match(line) and not _is_prose(line):
        return PassageShape.CODE
    if in_code and not _is_prose(line) and not _HEADING.match(line):
        return PassageShape.CODE
    if re.match(r"[-*•] |\d+\) ", line):
        return PassageShape.LIST
    return PassageShape.HEADING if _HEADING.match(line) and len(line) < 90 else PassageShape.PROSE


def _is_prose(line: str) -> bool:
    """Return whether a line ends as a sentence does and has several plain words."""
    return bool(_PROSE.match(line)) and len(re.findall(r"\b[a-z]+\b", line)) >= 4 and not line.rstrip().endswith("):")
