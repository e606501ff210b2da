"""Lines of code and output that belong together: the body of a function, lines of one kind, those that name things."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence

from busflow_assistant.answer_kinds import AnswerKind
from busflow_assistant.matching import Matched
from busflow_assistant.passages import PassageShape
from busflow_assistant.question import AskedQuestion
from busflow_assistant.rank import Ranked
from busflow_assistant.search_index import Citable, SearchIndex, indent
from busflow_assistant.words import stem

_BODY = 9
"""Lines of a function, or a command with its output, at most."""
_DEFINES = re.compile(r"(?:async )?def \w|@\w|class \w")
_NAME = r"[\"'](?P<name>[~/\w{}.-]+)[\"']"
_NAMES: Mapping[str, tuple[re.Pattern[str], ...]] = {
    "topic": (
        re.compile(rf"\b(?:create_)?(?:publisher|subscription)\(\s*(?:[\w.]+\s*,\s*)?{_NAME}"),
        re.compile(rf"\b(?:advertise|subscribe)\w*\(\s*(?:[\w.<>:]+\s*,\s*)?{_NAME}"),
        re.compile(r"(?:^|\s|`)(?P<name>/[a-z]\w*(?:/\w+)*)\s+(?:→\s+)?[\w]+/msg/\w+"),
        re.compile(
            r"\b(?:ros2|busflow) topic (?:echo|hz|pub|info|bw)\s+(?:-\S+\s+(?:\d+\s+)?)*(?P<name>/?[a-z][\w/]*)"
        ),
        re.compile(r"^(?P<name>/[a-z]\w*(?:/\w+)*)$"),
    ),
    "node": (
        re.compile(rf"super\(\).__init__\(\s*{_NAME}|\bcreate_node\(\s*{_NAME.replace('name', 'made')}"),
        re.compile(r"\bclass (?P<name>\w+)\((?:\w+\.)?Node\)"),
        re.compile(r"^(?P<name>/[a-z]\w*(?:/\w+)*)\s+\(\w+\)$"),
        re.compile(r"\bros2 run \w+ (?P<name>\w+)"),
    ),
    "servic": (
        re.compile(
            rf"\bcreate_(?:service|client)\(\s*(?:[\w.]+\s*,\s*)?{_NAME}"
            rf"|@service\(\w+\s*,\s*{_NAME.replace('name', 'made')}"
        ),
        re.compile(r"(?:^|\s|`)(?P<name>/[a-z]\w*(?:/\w+)*)\s+(?:[←→]\s+)?[\w]+/srv/\w+"),
    ),
    "paramet": (
        re.compile(rf"\bdeclare_parameter\(\s*{_NAME}"),
        re.compile(r"^(?P<name>[a-z]\w*):\s*[\w\[\], \"|.]+\s*=\s*Field\("),
    ),
}
"""How code and output name things, by the stem of the word for them."""


_ABOUT_ALL = frozenset(
    stem(word)
    for word in (
        "communicate",
        "communication",
        "exchange",
        "publish",
        "subscribe",
        "send",
        "receive",
        "message",
        "data",
    )
)
"""Words that do not restrict which of the names are asked for."""


def body(index: SearchIndex, unit: Citable, *, command: bool) -> list[Citable]:
    """Return what belongs to a line of code: a function's lines, and a command's output if that is asked for."""
    output = unit.text.startswith("$ ")
    if not (_DEFINES.match(unit.text) or (output and command)):
        return []
    found: list[Citable] = []
    for number in range(unit.number + 1, min(len(index.units), unit.number + _BODY)):
        line = index.units[number]
        ends = line.text.startswith("$ ") if output else _DEFINES.match(line.text) or indent(line) < indent(unit)
        if line.passage is not unit.passage or ends:
            break
        found.append(line)
    return found


def alike(best: Ranked, question: AskedQuestion, ranked: Sequence[Ranked]) -> tuple[Citable, ...]:
    """Return the lines of the best one's block that have as much of the question, for a question that wants all."""
    passage = best.unit.passage
    least = 0.8 * best.own
    found = [each.unit for each in ranked if each.unit.passage is passage and each.own >= least]
    heads = [unit for unit in found if any(head in unit.own for head in question.heads)]
    lines = sorted(heads or found, key=lambda unit: unit.number)
    apart = lines[-1].number - lines[0].number + 1
    return tuple(lines) if 2 * len(lines) > apart or (len(lines) > 2 and 5 * len(lines) > apart) else (best.unit,)


def names(
    question: AskedQuestion, matched: Sequence[Matched], index: SearchIndex, scope: Iterable[int]
) -> list[tuple[Citable, ...]]:
    """Return runs of lines that together name all topics, nodes, services or parameters, if a question asks for all."""
    kind = next((head for head in question.heads if head in _NAMES), None)
    if AnswerKind.LIST not in question.wanted or kind is None:
        return []
    if any(_restricts(each, kind) for each in matched):
        return []
    blocks: defaultdict[int, list[tuple[Citable, frozenset[str]]]] = defaultdict(list)
    for number in sorted(scope):
        unit = index.units[number]
        if unit.passage.shape is not PassageShape.HEADING and (named := frozenset(_named(kind, unit.text))):
            blocks[id(unit.passage)].append((unit, named))
    return list(_fewest([block for block in blocks.values() if block]))


def _restricts(each: Matched, kind: str) -> bool:
    """Return whether a word of the question says which of the names are asked for."""
    if kind in each.term.stems or _ABOUT_ALL & set(each.term.stems):
        return False
    return each.term.weight >= 0.6 and any(quality >= 0.8 for quality in each.variants.values())


def _named(kind: str, text: str) -> Iterator[str]:
    for pattern in _NAMES[kind]:
        for match in pattern.finditer(text):
            yield next(each for each in match.groupdict().values() if each).strip("/")


def _fewest(blocks: list[list[tuple[Citable, frozenset[str]]]]) -> Iterator[tuple[Citable, ...]]:
    """Yield the fewest blocks that have every name: that with most first; of equals, that with fewest other lines."""
    missing = frozenset(name for block in blocks for _, named in block for name in named)
    for _ in range(4):
        if not missing:
            return
        best = max(blocks, key=lambda block: (len(missing.intersection(*[_all(block)])), -_width(block)))
        new = missing & _all(best)
        yield tuple(_first_lines(best, new))
        missing -= new


def _first_lines(block: Sequence[tuple[Citable, frozenset[str]]], wanted: frozenset[str]) -> Iterator[Citable]:
    """Yield the first line of each name."""
    for unit, named in block:
        if named & wanted:
            yield unit
            wanted -= named


def _all(block: Sequence[tuple[Citable, frozenset[str]]]) -> frozenset[str]:
    return frozenset(name for _, named in block for name in named)


def _width(block: Sequence[tuple[Citable, frozenset[str]]]) -> int:
    return block[-1][0].span.end - block[0][0].span.start
