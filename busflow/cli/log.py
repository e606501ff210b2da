"""`busflow log`: shows the last lines of a running graph's log, follows it, and sets the level of a node."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import click

from busflow import timeouts
from busflow.bus.names import absolute_name
from busflow.cli.options.run import complete_nodes, joined, joins, until_run_ends
from busflow.cli.terminal.output import print_answer, print_line, print_message, require_reader
from busflow.clock import NS_PER_S
from busflow.errors import ExitCode, NoSuchTarget
from busflow.text import counted, did_you_mean, printable

if TYPE_CHECKING:
    from busflow.wire.client.client import Listener, Peer

_EXAMPLES = """\b
Examples:
  busflow log
  busflow log -f --node sensor_processor
  busflow log --level warning --json | jq -r .text
  busflow log --set sensor_processor debug"""

_TOPIC = "/rosout"
LEVELS = {"debug": 10, "info": 20, "warning": 30, "error": 40, "critical": 50}
_ROS_LEVELS = {"warn": "warning", "fatal": "critical"}
"""ROS 2's words for two of them."""
_COLOURS = {10: "bright_black", 20: "green", 30: "yellow", 40: "red", 50: "bright_red"}
_KEPT = 1000
_FOLLOWED = 10
"""How many earlier lines --follow shows first, as `tail -f` does."""
_MAIN = "main"
_LOOK_S = 0.2
"""The interval at which to check that the run is alive, while no line arrives."""

Line = Mapping[str, Any]
"""`{stamp_ns, level, node, text, process}`."""


@click.command(epilog=_EXAMPLES)
@click.option("-f", "--follow", is_flag=True, help="Show new lines as they are logged, until the run ends.")
@click.option("-n", "count", type=click.IntRange(0), metavar="N", help="At most the last N lines.  [default: all kept]")
@click.option("--node", metavar="NODE", shell_complete=complete_nodes, help="Only the lines of this node.")
@click.option("--level", type=click.Choice(list(LEVELS)), default="debug", help="Only lines of this level or above.")
@click.option(
    "--set",
    "setting",
    type=(str, click.Choice([*LEVELS, *_ROS_LEVELS])),
    metavar="NODE LEVEL",
    help="Have NODE log from LEVEL on, instead of showing lines: debug, info, warning, error, critical.",
)
@joins
def log(
    run: str | None,
    follow: bool,
    count: int | None,
    node: str | None,
    level: str,
    setting: tuple[str, str] | None,
    as_json: bool,
) -> int:
    """Show the log of a running graph: its last lines, of which the run keeps 1000.

    With -f it first shows the last 10 lines, or as many as -n says, and then new lines until the run ends. Debug lines
    exist if the graph was started with -v, or of a node whose level was set to debug.
    """
    if setting is not None:
        if follow or count is not None or node is not None:
            raise click.UsageError("--set shows no lines: give -f, -n and --node in a command of their own")
        return _set_level(run, *setting, as_json=as_json)
    show = print_line if as_json else _show
    least = LEVELS[level]
    with joined(run) as peer:
        name = _known(peer, node)
        wanted = _FOLLOWED if follow and count is None else _KEPT if count is None else count
        if not follow:
            for line in kept_lines(peer, wanted, node=name, level=least):
                show(line)
            return ExitCode.OK
        with peer.listen(peer.graph().topic(_TOPIC)) as listener:
            kept = kept_lines(peer, wanted, node=name, level=least)
            for line in kept:
                show(line)
            with until_run_ends():
                for line in _following(peer, listener, kept):
                    if line["level"] >= least and name in (None, line["node"]):
                        show(line)
        missed = listener.dropped + listener.lost
        if missed:
            lines = counted(missed, "line is", "lines are")
            print_message(f"warning: {lines} missing: more came than could be shown")
        return ExitCode.OK


def _set_level(run: str | None, node: str, level: str, *, as_json: bool) -> int:
    """Set the level of a node through its service, which nodes of ROS 2 may have too; FAILED if it refuses."""
    word = _ROS_LEVELS.get(level, level)
    with joined(run) as peer:
        name, reason = set_log_level(peer, node, word)
    if reason is not None:
        print_message(f"error: {name} keeps its level: {reason}")
        return ExitCode.FAILED
    if as_json:
        print_answer({"run": peer.run.name, "node": name, "level": word})
    else:
        click.echo(f"{printable(name)}: logs from {word} on")
    return ExitCode.OK


def set_log_level(peer: Peer, node: str, level: str) -> tuple[str, str | None]:
    """Set the level of a node through its service; return its full name, and why it keeps its level, if it does.

    Raises:
        NoSuchTarget: There is no such node, or it has no such service.
        ServiceError: It does not answer.
    """
    name = peer.graph().node(node).name
    service = f"{name}/set_logger_levels"
    if service not in peer.graph().services:
        raise NoSuchTarget(f"{printable(name)} has no service {printable(service)} to set its log level")
    logger = name.removeprefix("/").replace("/", ".")
    request = {"levels": [{"name": logger, "level": LEVELS[level]}]}
    (result,) = peer.call(peer.service(service), request, timeout_s=timeouts.current.answer)["results"]
    return name, None if result["successful"] else result["reason"]


def _known(peer: Peer, node: str | None) -> str | None:
    """Return the full name of a node that logs; `busflow` stands for the run itself."""
    if node is None or node == "busflow":
        return node
    full = absolute_name(node)
    logged = {line["node"] for line in kept_lines(peer)}
    nodes = {each.name for each in peer.graph().nodes.values() if not each.hidden} | logged
    if full not in nodes:
        raise NoSuchTarget(f"there is no node {printable(full)}; {did_you_mean(full, nodes)}")
    return full


def kept_lines(peer: Peer, count: int = _KEPT, *, node: str | None = None, level: int = 0) -> list[Line]:
    """Return the last lines of every process of the run, each once, sorted by time."""
    answers = peer.ask("log", count=count, node=node, level=level)
    # The main process also has the lines of its machine's other processes, which did log them: they go first.
    answers.sort(key=lambda answer: answer.get("process", _MAIN).endswith(_MAIN))
    found: dict[object, Line] = {}
    for answer in answers:
        for line in answer["lines"]:
            found.setdefault(_identity(line), {**line, "process": answer.get("process", _MAIN)})
    lines = sorted(found.values(), key=lambda line: line["stamp_ns"])
    return lines[-count:] if count else []


def _following(peer: Peer, listener: Listener, kept: list[Line]) -> Iterator[Line]:
    """Yield the lines that are logged after the kept ones.

    Raises:
        RunEnded: the run has ended.
        BrokenPipeError: nobody reads them any more.
    """
    decode = peer.type("rcl_interfaces/msg/Log").decode
    shown = {_identity(line) for line in kept}
    processes: dict[bytes, str] = {}
    while True:
        received = listener.get(_LOOK_S)
        if received is None:
            peer.require_run()
            require_reader()
            continue
        message = decode(received.payload)
        stamp = message["stamp"]
        line = {
            "stamp_ns": stamp["sec"] * NS_PER_S + stamp["nanosec"],
            "level": message["level"],
            "node": message["name"],
            "text": message["msg"],
            "process": _process_of(received.gid, processes, peer),
        }
        if _identity(line) not in shown:
            yield line


def _process_of(gid: bytes, known: dict[bytes, str], peer: Peer) -> str:
    """Return the process of the publisher with this GID; it is looked up once."""
    if gid not in known:
        processes = peer.processes()
        known |= {token.gid: processes.get(token.session, _MAIN) for token in peer.tokens()}
    return known.setdefault(gid, _MAIN)


def _identity(line: Line) -> tuple[object, ...]:
    return line["stamp_ns"], line["node"], line["text"]


def _show(line: Line) -> None:
    """Print a line as the run itself writes it, in UTC."""
    seconds, nanoseconds = divmod(line["stamp_ns"], NS_PER_S)
    word = next((word for word, number in LEVELS.items() if number == line["level"]), str(line["level"]))
    level = click.style(f"{word:<8}", fg=_COLOURS.get(line["level"]))
    text = "\n".join(printable(each) for each in line["text"].split("\n"))
    moment = datetime.fromtimestamp(seconds, UTC)
    process = line.get("process", _MAIN)
    where = f"[{printable(process)}] " if process != _MAIN else ""
    click.echo(f"{moment:%H:%M:%S}.{nanoseconds // 1_000_000:03} {level} {where}{printable(line['node'])}: {text}")
