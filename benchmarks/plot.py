"""Plot: lines on logarithmic axes, as SVG that reads well on a light and on a dark page.

It is written as plain text: the same figures give the same bytes, and a plot weighs some kilobytes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

WIDTH, HEIGHT = 680, 360
LEFT, RIGHT, TOP, BOTTOM = 62, 186, 40, 48
LINE_HEIGHT = 15
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#999999")
"""Told apart also by those who see colours otherwise (Okabe and Ito), on white and on black."""
STYLE = """\
text { font: 12px system-ui, sans-serif; fill: #24292f; }
.title { font-weight: 600; font-size: 13px; }
.grid { stroke: #d0d7de; stroke-width: 1; }
.line { fill: none; stroke-width: 1.5; }
.own { stroke-width: 3; }
@media (prefers-color-scheme: dark) { text { fill: #e6edf3; } .grid { stroke: #3d444d; } }"""


@dataclass(frozen=True)
class Line:
    """One contender: its name, and its value at each x where it has one."""

    name: str
    points: Sequence[tuple[float, float]]


def svg(title: str, x_title: str, y_title: str, lines: Sequence[Line], x_names: dict[float, str] | None = None) -> str:
    """The picture; the first line is drawn thicker than the others. `x_names` writes x otherwise than as a number."""
    xs = sorted({x for line in lines for x, _ in line.points})
    ys = [y for line in lines for _, y in line.points]
    low, high = math.floor(math.log10(min(ys))), math.ceil(math.log10(max(ys)))
    high = max(high, low + 1)
    span = math.log10(xs[-1] / xs[0]) or 1.0

    def across(x: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * math.log10(x / xs[0]) / span

    def up(y: float) -> float:
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (math.log10(y) - low) / (high - low)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">',
        f"<title>{escape(title)}</title><style>\n{STYLE}\n</style>",
        f'<text class="title" x="{LEFT}" y="18">{escape(title)}</text>',
        f'<text x="{LEFT}" y="33">{escape(y_title)}</text>',
        f'<text x="{(LEFT + WIDTH - RIGHT) / 2:.0f}" y="{HEIGHT - 10}" text-anchor="middle">{escape(x_title)}</text>',
    ]
    for exponent in range(low, high + 1):
        y = up(10.0**exponent)
        parts.append(f'<path class="grid" d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{10**exponent:,g}</text>')
    for x in xs:
        name = (x_names or {}).get(x, f"{x:,g}")
        parts.append(f'<text x="{across(x):.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{name}</text>')
    ends = [up(line.points[-1][1]) for line in lines]
    for number, (line, label) in enumerate(zip(lines, apart(ends), strict=True)):
        colour, own = COLOURS[number % len(COLOURS)], " own" if not number else ""
        path = "L".join(f"{across(x):.1f} {up(y):.1f}" for x, y in line.points)
        parts.append(f'<path class="line{own}" stroke="{colour}" d="M{path}"/>')
        parts += [f'<circle cx="{across(x):.1f}" cy="{up(y):.1f}" r="3" fill="{colour}"/>' for x, y in line.points]
        place = f'x="{WIDTH - RIGHT + 20}" y="{label + 4:.1f}"'
        weight = ' class="title"' if not number else ""
        parts.append(f'<rect x="{WIDTH - RIGHT + 8}" y="{label - 4:.1f}" width="8" height="8" fill="{colour}"/>')
        parts.append(f"<text{weight} {place}>{escape(line.name)}</text>")
    return "\n".join([*parts, "</svg>"]) + "\n"


def apart(heights: Sequence[float]) -> list[float]:
    """Where labels stand that belong at these heights, without covering one another.

    >>> apart([100.0, 101.0, 200.0])
    [100.0, 115.0, 200.0]
    """
    order = sorted(range(len(heights)), key=heights.__getitem__)
    found = list(heights)
    below = -math.inf
    for index in order:
        found[index] = below = max(found[index], below + LINE_HEIGHT)
    above = HEIGHT - BOTTOM + LINE_HEIGHT
    for index in reversed(order):  # what would stand below the plot pushes the others up
        found[index] = above = min(found[index], above - LINE_HEIGHT)
    return found
