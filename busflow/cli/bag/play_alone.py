"""`play_alone`: plays a recording as a run of its own, which other terminals can inspect."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

from busflow.bus.names import is_hidden
from busflow.cli.options.bag import refuse_beyond_end
from busflow.cli.terminal.output import log_stream, print_answer, print_message
from busflow.cli.terminal.player_console import Console, PlayerState
from busflow.errors import BusflowError, ExitCode
from busflow.log import LogRecord, console_sink
from busflow.node.supervision import supervised
from busflow.recording.bag.bag import Bag
from busflow.recording.player.ordered_messages import chosen
from busflow.recording.player.player import Player
from busflow.runner.assembly import Given, Kind, Run
from busflow.runner.graph import Graph
from busflow.text import counted, printable

_MOST_RATE = 1e6
_UNFIT = re.compile(r"[^\w.-]+")


def play_alone(asked: Mapping[str, Any], *, as_json: bool) -> int:
    """Play a recording in a run of its own, named after the file; return the exit code.

    Raises:
        BagError: The recording cannot be read.
        NoSuchTarget: It has none of the chosen topics.
        click.UsageError: It ends before the chosen start.
        LaunchError: It cannot be played.
    """
    with Bag(asked["file"]) as bag:
        # Errors found here name the file; the player would report them as errors of a node.
        chosen(bag.channels, asked["topics"], asked["exclude"], asked["rename"])
        refuse_beyond_end(bag, asked["start_s"])
        hidden = unplayed(bag, asked)
    player = Player(**asked)
    errors: list[str] = []
    stream, coloured = log_stream()
    write = console_sink(stream, colour=coloured)

    def sink(record: LogRecord) -> None:
        console.clear()
        write(record)

    given = Given(sinks=(sink,), inspect=_UNFIT.sub("_", Path(asked["file"]).stem) or "play")
    run = Run([supervised(player, on_exit="shutdown")], Kind.LAUNCH, given)
    graph = run.build()
    console = Console(_GraphControls(graph, player))
    with console.shown():
        code = run.go(errors.append)
    for text in errors:
        print_message(f"error: {text}")
    if errors:
        return code
    played = player.playing.played if player.playing is not None else 0
    return print_played(played, Path(asked["file"]), player.incomplete, code, hidden, as_json=as_json)


def unplayed(bag: Bag, asked: Mapping[str, Any]) -> str:
    """Return the hidden topics that are not played, which have to be named."""
    hidden = (
        ()
        if asked["topics"]
        else sorted({each.topic for each in bag.channels if is_hidden(each.topic) and each.count != 0})
    )
    return ", ".join(map(printable, hidden))


def print_played(
    played: int, file: Path, incomplete: tuple[str, ...], code: ExitCode, hidden: str, *, as_json: bool
) -> ExitCode:
    """Print how much was played; return the exit code, INCOMPLETE if the recording is not complete."""
    if as_json:
        print_answer({"file": str(file), "played": played, "complete": not incomplete, "why": list(incomplete)})
    else:
        beside = f", without the hidden {hidden}" if hidden else ""
        beside += ", and it is INCOMPLETE" if incomplete else ""
        click.echo(f"{printable(file)}: {counted(played, 'message')} played{beside}")
    return ExitCode.INCOMPLETE if code is ExitCode.OK and incomplete else code


class _GraphControls:
    """Controls of a player that is a node: they set its parameters, as other terminals can, once it plays."""

    def __init__(self, graph: Graph, player: Player) -> None:
        self._graph, self._player = graph, player

    def shown(self) -> PlayerState | None:
        """Return the player's state; None before it plays."""
        return None if self._player.playing is None else PlayerState.of(self._player.playing)

    def toggle(self) -> None:
        """Pause or resume."""
        self._set(paused=not self._player.parameters.paused)

    def step(self) -> None:
        """Play one message, while paused."""
        if self._player.playing is not None:
            with suppress(BusflowError):  # it may just have ended
                self._graph.bus.call(self._player.step)

    def pace(self, factor: float) -> None:
        """Play faster or slower."""
        self._set(rate=min(self._player.parameters.rate * factor, _MOST_RATE))

    def _set(self, **changes: object) -> None:
        if self._player.playing is not None:
            with suppress(BusflowError):  # as above
                self._graph.set_parameters(self._player, changes)
