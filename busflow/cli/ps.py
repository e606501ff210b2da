"""`busflow ps`: lists the runs on this machine, with file, process, programs, age and state."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.terminal.output import local_time, print_line, print_message, short_path
from busflow.cli.terminal.table import Column, print_table
from busflow.clock import NS_PER_S, SystemClock

if TYPE_CHECKING:
    from busflow.wire.client.runs import PresentRun

_EXAMPLES = """\b
Examples:
  busflow ps
  busflow ps --json | jq -r .run"""

_COLUMNS = (
    Column("RUN"),
    Column("FILE", folds=True),
    Column("PID", folds=True),
    Column("SINCE", goes=1),
    Column("AGE"),
    Column("NODES"),
    Column("STATE", folds=True),
)
_OF_PROGRAM = ("pid", "state", "restarts", "command")
_SHARED, _PROGRAMS = Column("SHARED", goes=2), Column("PROGRAMS", folds=True)
"""Columns before the last, if a run has what they show."""


@click.command(epilog=_EXAMPLES)
@click.option("--json", "as_json", is_flag=True, help="Print JSON, one object a line for each run.")
def ps(as_json: bool) -> None:
    """List the runs of this user on this machine; the exit code is 0 also if there are none.

    A run whose event loop is blocked, or whose process is stopped, is listed as one that does not answer. SHARED is the
    memory through which its processes exchange large messages, if they do.
    """
    from busflow.wire.client.runs import ask_runs

    if as_json:
        for each in ask_runs():
            print_line(_as_json(each))
        return
    found = list(ask_runs())
    if not found:
        print_message("nothing is running; start a graph in another terminal: busflow run FILE")
        return
    more = {_SHARED: _shared, _PROGRAMS: _programs}
    more = {column: cell for column, cell in more.items() if any(map(cell, found))}
    print_table((_row(each, more.values()) for each in found), *_COLUMNS[:-1], *more, _COLUMNS[-1])
    for each in found:
        if each.silence:
            print_message(f"warning: {each.run.name}, process {each.run.card.pid}: {each.silence}")


def _as_json(present: PresentRun) -> dict[str, Any]:
    card = present.run.card
    return {
        "run": present.run.name,
        "file": card.file or None,
        "since": _moment(card.since_ns).isoformat(timespec="milliseconds"),
        "pid": card.pid,
        "nodes": present.nodes,
        "state": present.state,
        "busflow": card.version,
        "processes": [
            {
                "name": each["process"],
                "pid": each["pid"],
                "nodes": each["nodes"],
                "restarts": each.get("restarts", 0),
                "shared_memory": each.get("shared_memory", 0),
            }
            for each in present.processes
        ],
        "programs": [{"name": each["program"], **{key: each[key] for key in _OF_PROGRAM}} for each in present.programs],
        **({"missing": dict(present.missing)} if present.missing else {}),
    }


def _row(present: PresentRun, more: Iterable[Callable[[PresentRun], str]]) -> tuple[object, ...]:
    card = present.run.card
    age_s = (SystemClock().now().nanoseconds - card.since_ns) // NS_PER_S
    nodes = "?" if present.nodes is None else present.nodes
    pids = ",".join(_pid(each) for each in present.processes) or card.pid
    file = short_path(card.file) if card.file else "-"
    cells = [cell(present) or "-" for cell in more]
    return present.run.name, file, pids, local_time(card.since_ns), _age(age_s), nodes, *cells, present.state


def _shared(present: PresentRun) -> str:
    return f"{present.shared_memory / (1 << 20):.0f} MiB" if present.shared_memory else ""


def _programs(present: PresentRun) -> str:
    return ", ".join(map(_program, present.programs))


def _program(program: Mapping[str, Any]) -> str:
    """Return a program's name and number, or its state where it does not run.

    >>> _program({"program": "/cam", "pid": 7, "state": "running"})
    '/cam 7'
    >>> _program({"program": "/cam", "pid": None, "state": "ended"})
    '/cam ended'
    """
    return f"{program['program']} {program['pid'] or program['state']}"


def _pid(process: Mapping[str, Any]) -> str:
    """Return a process's number, with its machine unless that is the main machine.

    >>> _pid({"process": "eyes", "pid": 7}), _pid({"process": "arm:eyes", "pid": 7})
    ('7', 'arm:7')
    """
    machine = str(process["process"]).rpartition(":")[0]
    return f"{machine}:{process['pid']}" if machine else str(process["pid"])


def _moment(ns: int) -> datetime:
    return datetime.fromtimestamp(ns / NS_PER_S, UTC)


def _age(seconds: int) -> str:
    """Return a duration in its two largest units.

    >>> _age(7), _age(130), _age(7_260), _age(200_000), _age(-3)
    ('7s', '2min 10s', '2h 1min', '2d 7h', '0s')
    """
    left, parts = max(0, seconds), list[str]()
    for unit, size in (("d", 86_400), ("h", 3_600), ("min", 60), ("s", 1)):
        count, left = divmod(left, size)
        if count:
            parts.append(f"{count}{unit}")
        elif parts:
            break
    return " ".join(parts[:2]) or "0s"
