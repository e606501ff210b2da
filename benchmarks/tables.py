"""Tables: what was found, as people read it in a terminal and on a page."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

from benchmarks.question import Case
from benchmarks.rounds import Figure, Outcome

_PREFIXES = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


@dataclass(frozen=True)
class Sheet:
    """One table: its title, its columns, and a row for each contender."""

    title: str
    columns: list[str]
    rows: list[tuple[str, list[str]]]


def sheets(outcome: Outcome) -> Iterator[Sheet]:
    """The tables of a question; cases of one title stand side by side."""
    question = outcome.question
    for title in dict.fromkeys(case.table for case in question.cases):
        cases = {case.name: case for case in question.cases if case.table == title}
        keys = [(case, name) for case in cases for name in outcome.names(case)]
        rows: list[tuple[str, list[str]]] = []
        for contender in question.contenders:
            cells = [cell(outcome.figure(contender.name, *key)) for key in keys]
            why = outcome.missing.get(contender.name) if any(map(contender.does, cases)) else None
            if why or any(cells):
                shown = f"{contender.name} ({contender.note})" if contender.note else contender.name
                rows.append((shown, ["missing", *[""] * (len(keys) - 1)] if why else cells))
        for quoted in question.quoted:
            if any(key in quoted.figures for key in keys):
                cells = [
                    amount(quoted.figures[key], key[1].split()[-1]) if key in quoted.figures else "" for key in keys
                ]
                rows.append((f"{quoted.name} (quoted)", cells))
        if rows:
            yield Sheet(title, [heading(cases[case], name) for case, name in keys], rows)


def heading(case: Case, name: str) -> str:
    """A column's head: the case, and the figure's name where it has one."""
    return ", ".join(filter(None, (case.heading, " ".join(name.split()[:-1]))))


def cell(figure: Figure | None) -> str:
    """A figure with its spread, and how many bare calls that is."""
    if figure is None:
        return ""
    spread = f" ±{figure.spread:.0%}" if figure.spread else ""
    calls = "" if figure.ratio is None else f"  {ratio(figure.ratio)}"
    return f"{amount(figure.median, figure.unit)}{spread}{calls}"


def amount(value: float, unit: str) -> str:
    """A value with its unit, in a size that can be read.

    >>> amount(2.5e-6, "s"), amount(5.3e9, "B"), amount(123456, "/s"), amount(1.234, "%")
    ('2.5 µs', '5.3 GB', '123 k/s', '1.2 %')
    """
    if unit == "s":
        scale, shown = next((each for each in _PREFIXES if abs(value) >= each[0]), _PREFIXES[-1])
        return f"{rounded(value / scale)} {shown}"
    if unit == "%":
        return f"{rounded(value)} %"
    for scale, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(value) >= scale:
            return f"{rounded(value / scale)} {prefix}{unit}"
    return f"{rounded(value)} {unit}".rstrip()


def ratio(calls: float) -> str:
    """So many times a bare call.

    >>> ratio(4.26), ratio(4260.0), ratio(42600.0), ratio(4.26e6)
    ('4.3×', '4,260×', '43 k×', '4.3 M×')
    """
    for least, scale, prefix in ((1e6, 1e6, "M"), (1e4, 1e3, "k")):
        if calls >= least:
            return f"{rounded(calls / scale)} {prefix}×"
    return f"{rounded(calls)}×"


def rounded(value: float) -> str:
    """A number with two figures that count, or all before the point.

    >>> rounded(0.0123), rounded(4.56), rounded(45.6), rounded(4567.8)
    ('0.012', '4.6', '46', '4,568')
    """
    if not value:
        return "0"
    return f"{value:,.{max(0, 1 - math.floor(math.log10(abs(value))))}f}"


def show(console: Console, outcome: Outcome) -> None:
    """Print what was found, and what could not be."""
    console.print(f"\n[bold]{outcome.question.title}[/bold]")
    console.print(outcome.question.explanation, style="dim")
    for sheet in sheets(outcome):
        table = Table(
            title=sheet.title, title_justify="left", title_style="", box=None, pad_edge=False, header_style="bold"
        )
        table.add_column("", no_wrap=True)
        for column in sheet.columns:
            table.add_column(column, justify="right")
        for name, cells in sheet.rows:
            table.add_row(name, *cells)
        console.print(table)
    for note in notes(outcome):
        console.print(note, markup=False)


def notes(outcome: Outcome) -> Iterator[str]:
    """What stands below the tables of a question."""
    missing = ", ".join(f"{contender} ({why})" for contender, why in outcome.missing.items())
    if missing:
        yield f"missing: {missing}. pip install --group bench (pip 25.1 or newer) brings every peer."
    for what, why in outcome.failed.items():
        yield f"failed: {what}: {why}"
    if outcome.question.quoted:
        yield outcome.question.quoted_from
    if outcome.call_s:
        call = sorted(outcome.call_s)[len(outcome.call_s) // 2]
        yield f"a bare call: {call * 1e9:.0f} ns; load {outcome.load[0]:.1f} → {outcome.load[1]:.1f}"
