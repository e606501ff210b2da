"""`busflow log`: the log of a running graph, its last lines and those that follow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.run import complete_nodes, joined, joins
from busflow.cli.terminal.output import print_line, print_message
from busflow.errors import NoSuchTarget
from busflow.text import counted, did_you_mean, printable

if TYPE_CHECKING:
    from busflow.wire.client.client import Listener, Peer

_EXAMPLES = """\b
Examples:
  busflow log
  busflow log -f --node sensor_processor
  busflow log --level warning --json | jq -r .text"""

_TOPIC = "/rosout"
_LEVELS = {"debug": 10, "info": 20, "warning": 30, "error": 40, "critical": 50}
_COLOURS = {10: "bright_black", 20: "green", 30: "yellow", 40: "red", 50: "bright_red"}
_NS_PER_S = 1_000_000_000
_KEPT = 1000
_FOLLOWED = 10
"""How many lines there are before those that follow, as `tail -f` has it."""
_MAIN = "main"
_LOOK_S = 0.2
"""How often it is looked whether the run still lives, while no line comes."""

Line = Mapping[str, Any]
"""`{stamp_ns, level, node, text, process}`."""


@click.command(epilog=_EXAMPLES)
@click.option("-f", "--follow", is_flag=True, help="Go on with the lines that follow, until the run ends.")
@click.option("-n", "count", type=click.IntRange(0), metavar="N", help="At most the last N lines.  [default: all kept]")
@click.option("--node", metavar="NODE", shell_complete=complete_nodes, help="Only what this node logs.")
@click.option("--level", type=click.Choice(list(_LEVELS)), default="debug", help="Only lines from this level on.")
@joins
def log(run: str | None, follow: bool, count: int | None, node: str | None, level: str, as_json: bool) -> None:
    """Show the log of a running graph: its last lines, of which the run keeps 1000.

    With -f it goes on until the run ends, after the last 10 lines or as many as -n says. Debug lines are there if the
    graph was started with -v.
    """
    show = print_line if as_json else _show
    least = _LEVELS[level]
    with joined(run) as peer:
        name = _known(peer, node)
        wanted = _FOLLOWED if follow and count is None else _KEPT if count is None else count
        if not follow:
            for line in _kept(peer, wanted, name, least):
                show(line)
            return
        with peer.listen(peer.graph().topic(_TOPIC)) as listener:
            kept = _kept(peer, wanted, name, least)
            for line in kept:
                show(line)
            for line in _following(peer, listener, kept):
                if line["level"] >= least and name in (None, line["node"]):
                    show(line)
        missed = listener.dropped + listener.lost
        if missed:
            lines = counted(missed, "line is", "lines are")
            print_message(f"warning: {lines} missing: more came than could be shown")


def _known(peer: Peer, node: str | None) -> str | None:
    """The full name of a node that logs; `busflow` is the run itself."""
    if node is None or node == "busflow":
        return node
    full = f"/{node.removeprefix('/')}"
    logged = {line["node"] for line in _kept(peer, _KEPT, None, 0)}
    nodes = {each.name for each in peer.graph().nodes.values() if not each.hidden} | logged
    if full not in nodes:
        raise NoSuchTarget(f"there is no node {printable(full)}; {did_you_mean(full, nodes)}")
    return full


def _kept(peer: Peer, count: int, node: str | None, level: int) -> list[Line]:
    """The last lines of every process of the run."""
    answers = peer.ask("log", count=count, node=node, level=level)
    # The main process has the lines of the others of its machine too, and is not the one that logged them.
    answers.sort(key=lambda answer: answer.get("process", _MAIN).endswith(_MAIN))
    found: dict[object, Line] = {}
    for answer in answers:
        for line in answer["lines"]:
            found.setdefault(_identity(line), {**line, "process": answer.get("process", _MAIN)})
    lines = sorted(found.values(), key=lambda line: line["stamp_ns"])
    return lines[-count:] if count else []


def _following(peer: Peer, listener: Listener, kept: list[Line]) -> Iterator[Line]:
    """The lines that come after those that were kept, until the run has ended."""
    decode = peer.type("rcl_interfaces/msg/Log").decode
    shown = {_identity(line) for line in kept}
    processes: dict[bytes, str] = {}
    while True:
        received = listener.get(_LOOK_S)
        if received is None:
            if not peer.alive:
                return
            continue
        message = decode(received.payload)
        stamp = message["stamp"]
        line = {
            "stamp_ns": stamp["sec"] * _NS_PER_S + stamp["nanosec"],
            "level": message["level"],
            "node": message["name"],
            "text": message["msg"],
            "process": _process_of(received.gid, processes, peer),
        }
        if _identity(line) not in shown:
            yield line


def _process_of(gid: bytes, known: dict[bytes, str], peer: Peer) -> str:
    """The process that publishes with this signature; it is looked up once."""
    if gid not in known:
        processes = peer.processes()
        known |= {token.gid: processes.get(token.session, _MAIN) for token in peer.tokens()}
    return known.setdefault(gid, _MAIN)


def _identity(line: Line) -> tuple[object, ...]:
    return line["stamp_ns"], line["node"], line["text"]


def _show(line: Line) -> None:
    """A line as the run itself writes it, in UTC."""
    seconds, nanoseconds = divmod(line["stamp_ns"], _NS_PER_S)
    word = next((word for word, number in _LEVELS.items() if number == line["level"]), str(line["level"]))
    level = click.style(f"{word:<8}", fg=_COLOURS.get(line["level"]))
    text = "\n".join(printable(each) for each in line["text"].split("\n"))
    moment = datetime.fromtimestamp(seconds, UTC)
    process = line.get("process", _MAIN)
    where = f"[{printable(process)}] " if process != _MAIN else ""
    click.echo(f"{moment:%H:%M:%S}.{nanoseconds // 1_000_000:03} {level} {where}{printable(line['node'])}: {text}")
