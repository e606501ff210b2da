"""Live parts: comments of Markdown that name a panel, such as `<!-- busflow-plot topic=/imu/data field=… -->`. Pure.

On other sites a comment shows nothing, so a page stays good Markdown. Here each becomes an element, with the attributes
that its kind has and no others; every other comment shows nothing here either.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape

from busflow.text import did_you_mean, printable

_COMMENT = re.compile(r"<!--\s*busflow-(?P<kind>[\w-]*)(?P<rest>.*?)-->", re.DOTALL)
_PAIR = re.compile(r"""\s*(?P<name>[\w-]+)=(?:"(?P<quoted>[^"]*)"|(?P<plain>[^\s"'<>]+))""")
_NAME = re.compile(r"[\w./~{}-]{1,256}")
_FIELDS = re.compile(r"[\w.\[\]]{1,128}(?: [\w.\[\]]{1,128}){0,7}")
_WORDS = re.compile(r"[\w./:=-]{1,128}(?: [\w./:=-]{1,128}){0,15}")


@dataclass(frozen=True, slots=True)
class _Kind:
    """Kind of live part: its attributes with what their values may be, and what it shows."""

    needed: Mapping[str, re.Pattern[str]]
    what: str


_KINDS: Mapping[str, _Kind] = {
    "plot": _Kind({"topic": _NAME, "field": _FIELDS}, "a plot of {topic}"),
    "graph": _Kind({}, "the graph"),
    "log": _Kind({}, "the log"),
    "parameter": _Kind({"node": _NAME, "name": _FIELDS}, "the parameter {name} of {node}"),
}


@dataclass(frozen=True, slots=True)
class LivePart:
    """Panel in a page."""

    kind: str
    attributes: Mapping[str, str]
    run: str
    """What starts the run that it needs, such as `configs/lab1.yaml`; empty where the page says it elsewhere."""


def read(comment: str) -> LivePart | str | None:
    """Return the live part that a comment names, why it is none, or None for a comment of another kind.

    >>> read("<!-- busflow-plot topic=/imu/data field=linear_acceleration.x -->").attributes
    {'topic': '/imu/data', 'field': 'linear_acceleration.x'}
    >>> read("<!-- busflow-plat -->")
    "busflow-plat is no live part; did you mean 'plot'?"
    >>> read("<!-- TODO -->")
    """
    found = _COMMENT.fullmatch(comment.strip())
    if found is None:
        return None
    word, kind = found["kind"], _KINDS.get(found["kind"])
    if kind is None:
        return f"busflow-{printable(word)} is no live part; {did_you_mean(word, _KINDS)}"
    given = {each["name"]: each["quoted"] or each["plain"] or "" for each in _PAIR.finditer(found["rest"])}
    if _PAIR.sub("", found["rest"]).strip():
        return f'busflow-{word}: attributes are written name=value or name="a value"'
    allowed = {**kind.needed, "run": _WORDS}
    for name, value in given.items():
        if name not in allowed:
            return f"busflow-{word} has no attribute {printable(name)}; {did_you_mean(name, allowed)}"
        if not allowed[name].fullmatch(value):
            return f"busflow-{word}: {name} cannot be {printable(value)!r}"
    if missing := [name for name in kind.needed if name not in given]:
        return f"busflow-{word} needs {' and '.join(missing)}"
    return LivePart(word, {name: given[name] for name in kind.needed}, given.get("run", ""))


def html(part: LivePart, *, is_block: bool) -> str:
    """Return the element of a live part: until a run is there it says how to start one."""
    tag = "div" if is_block else "span"
    attributes = "".join(f' data-{name}="{escape(value)}"' for name, value in part.attributes.items())
    what = _KINDS[part.kind].what.format_map(part.attributes)
    start = f": <code>busflow run {escape(part.run)}</code>" if part.run else "."
    how = f'<span class="live-how">Here is {escape(what)}, live, while the lab runs{start}</span>'
    return f'<{tag} class="live live-{part.kind}" data-live="{part.kind}"{attributes}>{how}</{tag}>'
