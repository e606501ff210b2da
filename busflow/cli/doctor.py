"""`busflow doctor`: checks versions, run directories, and whether each run answers and what is wrong in it."""

from __future__ import annotations

import platform
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import click

import busflow
from busflow.cli.options.run import complete_runs
from busflow.cli.root import Root
from busflow.cli.terminal.output import outcome_printed, print_answer, print_problems, short_path
from busflow.cli.terminal.table import Column, print_table
from busflow.errors import BusflowError, ExitCode, InspectionUnavailable, Problem, Severity
from busflow.text import counted

if TYPE_CHECKING:
    from busflow.wire.client.client import Peer
    from busflow.wire.client.graph_view import GraphView
    from busflow.wire.client.runs import PresentRun
    from busflow.wire.zenoh.run_directory import Folder

_EXAMPLES = """\b
Examples:
  busflow doctor
  busflow doctor --run lab1 --json | jq '.findings[].message'"""


_LISTEN_S = 0.5
"""Time to listen to the frames of a run that has any."""
_MOST_ADDRESSES = 3
"""Limit of the addresses that a finding names."""
_Findings = list[tuple[str | None, Problem]]
"""Problems, each with the name of its run, or None."""


@dataclass(frozen=True, slots=True)
class _Examined:
    """One run with its problems."""

    present: PresentRun
    clock: str
    topics: int
    findings: tuple[Problem, ...]
    neighbours: Mapping[str, Sequence[str]] = field(default_factory=dict[str, Sequence[str]])
    """Nodes of ROS 2, by host."""


@click.command(epilog=_EXAMPLES)
@click.option("--run", metavar="NAME", shell_complete=complete_runs, help="Only this run; see busflow ps.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.pass_context
def doctor(context: click.Context, run: str | None, as_json: bool) -> int:
    """Show versions, run directories and runs, and what is wrong in each; exit code 3 if something is wrong.

    Directories left behind by dead runs are removed.
    """
    folders = _folders()
    machine = (*_about_inspection(), *_about_commands(context), *_about_folders(folders))
    findings = _Findings((None, each) for each in machine)
    examined = [_examine(present) for present in _runs(run, findings)]
    findings += [(each.present.run.name, problem) for each in examined for problem in each.findings]
    with outcome_printed():
        if as_json:
            rows = [{"run": name, **problem.as_json()} for name, problem in findings]
            runs = [_run_json(each) for each in examined]
            print_answer({"ok": not findings, **_surroundings(folders), "runs": runs, "findings": rows})
        else:
            _print(folders, examined, findings)
    return ExitCode.DIFFERENT if findings else ExitCode.OK


def _runs(run: str | None, findings: _Findings) -> Iterator[PresentRun]:
    """Yield the run of this name, or all runs, each asked for its state.

    Raises:
        NoSuchRun: There is no run of this name.
        InspectionUnavailable: The runs cannot be listed, which no finding says yet.
    """
    from busflow.wire.client.runs import ask_run, ask_runs

    if run is not None:
        from busflow.wire.client.client import run_called

        yield ask_run(run_called(run))
        return
    try:
        yield from ask_runs()
    except InspectionUnavailable:
        if not findings:  # an unsafe folder is reported already
            raise


# Examining.


def _versions() -> dict[str, str | None]:
    try:
        zenoh = version("eclipse-zenoh")
    except PackageNotFoundError:
        zenoh = None
    return {"busflow": busflow.__version__, "python": platform.python_version(), "zenoh": zenoh}


def _folders() -> list[Folder]:
    """Return the folders for runs; none where the platform has nothing that connects terminals with runs."""
    from busflow.wire.zenoh.run_directory import folders

    try:
        return folders()
    except InspectionUnavailable:
        return []


def _about_inspection() -> Iterator[Problem]:
    """Yield what this machine lacks for one terminal to inspect the runs of another."""
    from busflow.wire.zenoh.session import require_unix_sockets, require_zenoh

    try:
        require_unix_sockets()
    except InspectionUnavailable as error:
        yield Problem("no-unix-sockets", f"runs cannot be inspected: {error}", "busflow run, check and test work here")
        return
    try:
        require_zenoh()
    except InspectionUnavailable as error:
        yield Problem("no-zenoh", f"runs cannot be inspected: {error}", "pip install eclipse-zenoh")


def _about_commands(context: click.Context) -> Iterator[Problem]:
    root = context.find_root().command
    if isinstance(root, Root):
        yield from root.problems()


def _about_folders(folders: list[Folder]) -> Iterator[Problem]:
    for each in folders:
        if each.fault:
            yield Problem("unsafe-folder", each.fault, f"see who owns it: ls -ld {each.path}")


def _examine(present: PresentRun) -> _Examined:
    if present.silence:
        fix = f"look at process {present.run.card.pid}: a handler must not block; use run_sync for what does"
        return _Examined(present, "?", 0, (Problem("silent", present.silence, fix),))
    from busflow.wire.client.client import Peer

    try:
        with closing(Peer(present.run)) as peer:
            return _examine_joined(present, peer)
    except BusflowError as error:
        return _Examined(present, "?", 0, (Problem("silent", str(error), "ask again"),))


def _examine_joined(present: PresentRun, peer: Peer) -> _Examined:
    from busflow.ros2.definitions import differences
    from busflow.ros2.neighbours import crowds, neighbours, strangers
    from busflow.wire.client.checkup import findings
    from busflow.wire.client.graph_view import view

    tokens, answers = peer.look()
    graph = view(tokens, answers)
    clocks = ", ".join(dict.fromkeys(answer["clock"] for answer in answers))
    topics = sum(not topic.hidden for topic in graph.topics.values())
    others = neighbours(tokens, answers)
    wrong = (
        *_about_version(present),
        *_about_machines(present),
        *_about_connections(present),
        *_about_processes(present),
        *_about_programs(present),
        *findings(graph, tokens, answers),
        *differences(peer, graph),
        *strangers(others, present.run.card.domain),
        *crowds(answers),
        *_about_frames(peer, graph),
    )
    return _Examined(present, clocks, topics, wrong, others)


def problems_in(peer: Peer) -> tuple[Problem, ...]:
    """Return everything that `busflow doctor` finds wrong in a run that is joined.

    Raises:
        InspectionUnavailable: It does not answer.
    """
    from busflow.wire.client.runs import ask_peer

    return _examine_joined(ask_peer(peer), peer).findings


def _about_machines(present: PresentRun) -> Iterator[Problem]:
    for name, reason in present.missing.items():
        text = f"the machine {name} is not linked" + (f": {reason}" if reason else "")
        fix = f"start it there: busflow run {short_path(present.run.card.file)} --machine {name}"
        yield Problem("machine-missing", text, fix.removesuffix(" --machine main"), severity=Severity.WARNING)
    own = present.run.card.version
    for name, theirs in present.versions.items():
        if theirs != own:
            text = f"the machine {name} has busflow {theirs}, and the run's own machine {own}"
            yield Problem("other-version", text, "install one version on both", severity=Severity.WARNING)


def _about_connections(present: PresentRun) -> Iterator[Problem]:
    from busflow.wire.machines.silent_connections import silent_connections

    silent = silent_connections(present.port) if present.port is not None else ()
    if silent:
        peers = list(dict.fromkeys(each.peer for each in silent))
        more = len(peers) - _MOST_ADDRESSES
        shown = ", ".join(peers[:_MOST_ADDRESSES]) + (f" and {more} more" if more > 0 else "")
        what = counted(len(silent), "connection has", "connections have")
        text = f"{what} sent nothing to port {present.port} for up to {silent[0].silent_s:.0f} s, from {shown}"
        fix = "let a firewall admit your machines only: silent connections keep them out"
        yield Problem("silent-connections", text, fix, severity=Severity.WARNING)


def _about_processes(present: PresentRun) -> Iterator[Problem]:
    for each in present.processes:
        if restarts := each.get("restarts", 0):
            text = f"the process {each['process']} was started anew {counted(restarts, 'time')}"
            fix = "busflow log --level warning shows why; the counts of its nodes began again at 0"
            yield Problem("process-restarted", text, fix, severity=Severity.WARNING)


def _about_programs(present: PresentRun) -> Iterator[Problem]:
    for each in present.programs:
        if restarts := each["restarts"]:
            text = f"the program {each['program']} was started anew {counted(restarts, 'time')}"
            text += f"; the last time, {each['last_failure']}" if each["last_failure"] else ""
            fix = f"see what it printed: busflow log --node {each['program']}"
            yield Problem("program-restarted", text, fix, severity=Severity.WARNING)
        if each["state"] == "waiting":
            text = f"the program {each['program']} has not started: it waits for what it depends on"
            yield Problem(
                "program-waits", text, "busflow node list -v shows what has not started", severity=Severity.WARNING
            )


def _about_frames(peer: Peer, graph: GraphView) -> Iterator[Problem]:
    from busflow.wire.client.frames import follow_frames, publishes_frames

    if not publishes_frames(graph):
        return
    from busflow.frames.seen import SeenFrames

    seen = SeenFrames()
    for each in follow_frames(peer, graph, _LISTEN_S):
        if each is not None:
            seen.add(each.message, each.publishers, each.published_ns, fixed=each.fixed)
    yield from seen.problems()


def _about_version(present: PresentRun) -> Iterator[Problem]:
    theirs = present.run.card.version
    if theirs != busflow.__version__:
        text = f"it runs busflow {theirs or 'of an unknown version'}, and this is {busflow.__version__}"
        yield Problem("other-version", text, "restart it, or use its version of busflow", severity=Severity.WARNING)


# Showing.


def _print(folders: list[Folder], examined: list[_Examined], findings: _Findings) -> None:
    versions = _versions()
    print_table(
        [
            ("busflow", versions["busflow"]),
            ("Python", f"{versions['python']} on {platform.system()} {platform.release()}"),
            ("Zenoh", versions["zenoh"] or "missing"),
            *(("runs in", f"{each.path}: {_state(each)}") for each in folders),
            *(row for each in examined for row in _rows(each)),
        ],
        Column(),
        Column(folds=True),
    )
    if not examined:
        click.echo("nothing is running")
    for name, problems in groupby(findings, key=itemgetter(0)):
        click.echo(f"\n{name}:" if name else "")
        print_problems(problem for _, problem in problems)
    click.echo(f"\n{counted(len(findings), 'finding') if findings else 'nothing is wrong'}")


def _state(folder: Folder) -> str:
    if not folder.exists:
        return "not there, which is fine"
    if folder.fault:
        return "not safe"
    return "safe" + (f"; removed what is left of {', '.join(folder.remains)}" if folder.remains else "")


def _rows(each: _Examined) -> Iterator[tuple[str, str]]:
    yield each.present.run.name, _sentence(each)
    if each.neighbours:
        from busflow.ros2.neighbours import shown

        yield f"ROS 2, domain {each.present.run.card.domain}", shown(each.neighbours)


def _sentence(each: _Examined) -> str:
    if each.present.silence:
        return "does not answer"
    answer = f"answers in {each.present.answered_in_s * 1000:.1f} ms"
    counts = f"{counted(each.present.nodes or 0, 'node')}, {counted(each.topics, 'topic')}"
    return f"{counts}, {each.clock} clock, {answer}"


def _surroundings(folders: list[Folder]) -> Mapping[str, Any]:
    rows = [
        {"path": str(each.path), "exists": each.exists, "safe": not each.fault, "removed": list(each.remains)}
        for each in folders
    ]
    system = f"{platform.system()} {platform.release()} {platform.machine()}"
    return {"versions": _versions(), "system": system, "folders": rows}


def _run_json(each: _Examined) -> dict[str, Any]:
    present = each.present
    return {
        "run": present.run.name,
        "state": present.state,
        "nodes": present.nodes,
        "topics": None if present.silence else each.topics,
        "clock": None if present.silence else each.clock,
        "ros2_nodes": each.neighbours,
        "answered_in_ms": None if present.silence else present.answered_in_s * 1000,
    }
