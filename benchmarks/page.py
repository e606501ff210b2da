"""Page: the part of docs/performance.md that the benchmarks write, and its plots.

Each question has its place between two marks, so that asking one again changes its figures alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from benchmarks.crossing import SIZES
from benchmarks.plot import Line, svg
from benchmarks.record import machine
from benchmarks.rounds import ROOT, Figure, Outcome
from benchmarks.tables import notes, sheets

PAGE = ROOT / "docs/performance.md"
PLOTS = ROOT / "docs/performance"
IN_PROCESS = ("busflow", "bare calls", "asyncio.Queue", "anyio stream", "reactivex", "ezmsg", "Zenoh, one session")
BETWEEN = ("busflow", "Zenoh", "pyzmq", "ezmsg", "asyncio unix socket", "shared memory")


@dataclass(frozen=True)
class Plotted:
    """One plot: from which question, and which figure at each x."""

    question: str
    file: str
    title: str
    x_title: str
    y_title: str
    cases: dict[float, str]
    names: Sequence[str]
    value: Callable[[Figure], float | None]
    figure: str = "s"
    x_names: dict[float, str] | None = None


def _calls(figure: Figure) -> float | None:
    return figure.ratio


def _microseconds(figure: Figure) -> float | None:
    return figure.median * 1e6


COUNTS = (1, 10, 100, 1000)
IN_CALLS = "CPU time in bare calls, medians"
PLOTTED = (
    Plotted(
        "delivery", "fan-out", "A publish, by its subscribers", "subscribers", IN_CALLS,
        {count: f"1 → {count}, def" for count in (1, 10, 100)}, IN_PROCESS, _calls,
    ),
    Plotted(
        "scale", "depth", "A delivery, by the messages that wait with it", "messages that wait in the queue", IN_CALLS,
        {count: f"{count} waiting" for count in COUNTS}, IN_PROCESS, _calls,
    ),
    Plotted(
        "scale", "topics", "A delivery, each on another topic", "topics", IN_CALLS,
        {count: f"{count} topics" for count in COUNTS}, IN_PROCESS, _calls,
    ),
    Plotted(
        "scale", "nodes", "A delivery, by what else there is", "topics, each with two nodes", IN_CALLS,
        {count: f"{count} idle" for count in COUNTS}, IN_PROCESS, _calls,
    ),
    Plotted(
        "processes", "size", "Into a handler of another process, by size", "size of the message",
        "µs from publish to handler, medians", {size: name for name, size in SIZES.items()}, BETWEEN, _microseconds,
        "p50 s", {size: name for name, size in SIZES.items()},
    ),
)  # fmt: skip


def write(outcomes: Sequence[Outcome]) -> None:
    """Put what was found into the page, and draw the plots."""
    text = PAGE.read_text(encoding="utf-8")
    for outcome in outcomes:
        text = replaced(text, outcome.question.name, "\n".join(_section(outcome)))
    PAGE.write_text(text, encoding="utf-8")


def replaced(text: str, name: str, content: str) -> str:
    r"""The text with other content between the marks of this name.

    >>> replaced("a\n<!-- measured: x -->\nold\n<!-- end of x -->\nb", "x", "new")
    'a\n<!-- measured: x -->\n\nnew\n\n<!-- end of x -->\nb'
    """
    begin, end = f"<!-- measured: {name} -->\n", f"<!-- end of {name} -->"
    before, found, rest = text.partition(begin)
    _, ended, after = rest.partition(end)
    if not found or not ended:
        raise SystemExit(f"{PAGE.name} has no place for {name}: write {begin.strip()} and {end} where it belongs")
    return f"{before}{begin}\n{content}\n\n{end}{after}"


def _section(outcome: Outcome) -> Iterator[str]:
    yield outcome.question.explanation
    for sheet in sheets(outcome):
        yield f"\n**{sheet.title}**\n"
        yield f"| | {' | '.join(sheet.columns)} |"
        yield f"|---|{'---:|' * len(sheet.columns)}"
        for name, cells in sheet.rows:
            shown = f"**{name}**" if name.startswith("busflow") else name
            yield f"| {shown} | {' | '.join(cells)} |"
    for plotted in PLOTTED:
        if plotted.question == outcome.question.name and (drawn := _drawn(plotted, outcome)):
            PLOTS.mkdir(exist_ok=True)
            file = PLOTS / f"{plotted.file}.svg"
            file.write_text(drawn, encoding="utf-8")
            yield f"\n![{plotted.title}]({file.relative_to(PAGE.parent)})"
    yield ""
    yield from notes(outcome)
    yield f"\nMeasured on {machine()}."


def _drawn(plotted: Plotted, outcome: Outcome) -> str:
    lines: list[Line] = []
    for name in plotted.names:
        found = [(x, outcome.figure(name, case, plotted.figure)) for x, case in plotted.cases.items()]
        points = [(x, value) for x, figure in found if figure is not None and (value := plotted.value(figure))]
        if points:
            lines.append(Line(name, points))
    if not lines:
        return ""
    return svg(plotted.title, plotted.x_title, plotted.y_title, lines, plotted.x_names)
