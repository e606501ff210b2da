"""How a command is told which recording it is to read, which of its topics, and which stretch of its time."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.launch_file import DurationType
from busflow.cli.terminal.output import print_message
from busflow.errors import ExitCode, NoSuchTarget
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag
    from busflow.recording.bag.channel import Channel

_ZERO = re.compile(r"0+(\.0*)? *(ns|us|ms|s|min|h)?")


class _Offset(DurationType):
    """As `DurationType`, or zero: so long after the first message."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | None:
        return 0.0 if _ZERO.fullmatch(value.strip()) else super().convert(value, param, ctx)


_OFFSET = _Offset()


def reads(name: str = "file") -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Adds the argument that names a recording: an .mcap file, or the directory of a bag of ROS 2."""
    return click.argument(name, metavar=name.strip("_").upper(), type=click.Path(path_type=Path))


def within(command: Callable[..., Any]) -> Callable[..., Any]:
    """Adds `--start` and `--end`, which a command gets in seconds as `start_s` and `end_s`."""
    for word, what in (("end", "Leave out what comes later than so long"), ("start", "Begin so long")):
        command = click.option(
            f"--{word}",
            f"{word}_s",
            type=_OFFSET,
            help=f"{what} after the first message.",
        )(command)
    return command


def stretch(bag: Bag, start_s: float | None, end_s: float | None) -> tuple[int | None, int | None]:
    """The log times between which messages are wanted.

    Raises:
        click.UsageError: The recording ends before.
    """
    if start_s is None and end_s is None:
        return None, None
    refuse_beyond_end(bag, start_s)
    begin = bag.start_ns or 0
    return begin + round((start_s or 0) * 1e9), None if end_s is None else begin + round(end_s * 1e9)


def refuse_beyond_end(bag: Bag, start_s: float | None) -> None:
    """Say that there is nothing from so long after the first message on.

    Raises:
        click.UsageError: The recording ends before.
    """
    if not start_s or bag.start_ns is None or bag.end_ns is None:
        return
    length_s = (bag.end_ns - bag.start_ns) / 1e9
    if start_s > length_s:
        whole = f"{printable(bag.path)} ends {length_s:g} s after its first message"
        raise click.UsageError(f"--start {start_s:g}s is beyond the end: {whole}")


def named(names: Iterable[str], *bags: Bag) -> list[Channel]:
    """The channels of the topics of these names, which need no slash in front, in one of the bags at least.

    Raises:
        NoSuchTarget: There is no such topic.
    """
    channels = [channel for bag in bags for channel in bag.channels]
    found: list[Channel] = []
    for name in names:
        those = [each for each in channels if each.topic in (name, f"/{name}")]
        if not those:
            for bag in bags:
                print_damage(bag)
            where = " or ".join(str(bag.path) for bag in bags)
            guess = did_you_mean(name, [each.topic for each in channels])
            raise NoSuchTarget(f"{where}: there is no topic {printable(name)} in it; {guess}")
        found += those
    return found


def print_damage(bag: Bag) -> ExitCode:
    """Say where the recording could not be read any further, if that is so; the exit code for it."""
    for damage in bag.damages:
        print_message(f"warning: {damage}")
    return ExitCode.INCOMPLETE if bag.damages else ExitCode.OK


def listed(_ctx: click.Context, _param: click.Parameter, given: str | None) -> list[str]:
    """The callback of an option that takes names with commas between them."""
    return [] if given is None else [name.strip() for name in given.split(",") if name.strip()]
