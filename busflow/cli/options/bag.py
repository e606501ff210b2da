"""Options and arguments that choose a recording, its topics, and a part of its time."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.interfaces import takes_interfaces
from busflow.cli.options.launch_file import DurationType
from busflow.cli.terminal.output import print_message
from busflow.errors import ExitCode, NoSuchTarget
from busflow.text import did_you_mean, printable
from busflow.validation.byte_sizes import parse_size

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag
    from busflow.recording.bag.channel import Channel

    _TextType = click.ParamType[int]
else:
    _TextType = click.ParamType  # generic in newer versions of click only

_ZERO = re.compile(r"0+(\.0*)? *(ns|us|ms|s|min|h)?")


class _Offset(DurationType):
    """The type of an option that takes a duration or zero, counted from the first message."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | None:
        return 0.0 if _ZERO.fullmatch(value.strip()) else super().convert(value, param, ctx)


class _Size(_TextType):
    """The type of an option that takes `64MiB`, `500MB`, or a plain number of bytes."""

    name = "size"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the size in bytes."""
        try:
            return parse_size(int(value) if value.isdecimal() and len(value) < 20 else value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


_OFFSET = _Offset()
SIZE = _Size()


def reads(name: str = "file") -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add the argument that names a recording, an .mcap file or the directory of a ROS 2 bag, and `--interfaces`."""
    argument = click.argument(name, metavar=name.strip("_").upper(), type=click.Path(path_type=Path))
    return lambda command: takes_interfaces(argument(command))


def within(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add `--start` and `--end`, which the command receives in seconds as `start_s` and `end_s`."""
    for word, what in (("end", "End this long"), ("start", "Begin this long")):
        command = click.option(
            f"--{word}",
            f"{word}_s",
            type=_OFFSET,
            help=f"{what} after the first message.",
        )(command)
    return command


def stretch(bag: Bag, start_s: float | None, end_s: float | None) -> tuple[int | None, int | None]:
    """Return the log times between which messages are wanted.

    Raises:
        click.UsageError: The recording ends before the start.
    """
    if start_s is None and end_s is None:
        return None, None
    refuse_beyond_end(bag, start_s)
    begin = bag.start_ns or 0
    return begin + round((start_s or 0) * 1e9), None if end_s is None else begin + round(end_s * 1e9)


def refuse_beyond_end(bag: Bag, start_s: float | None) -> None:
    """Refuse a start that is after the last message.

    Raises:
        click.UsageError: The recording ends before the start.
    """
    if not start_s or bag.start_ns is None or bag.end_ns is None:
        return
    length_s = (bag.end_ns - bag.start_ns) / 1e9
    if start_s > length_s:
        whole = f"{printable(bag.path)} ends {length_s:g} s after its first message"
        raise click.UsageError(f"--start {start_s:g}s is beyond the end: {whole}")


def named(names: Iterable[str], *bags: Bag) -> list[Channel]:
    """Return the channels of the named topics in any of the bags; a leading slash may be left out.

    Raises:
        NoSuchTarget: A topic is in none of the bags.
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
    """Print where the recording is damaged, if it is; return the exit code for that."""
    for damage in bag.damages:
        print_message(f"warning: {damage}")
    return ExitCode.INCOMPLETE if bag.damages else ExitCode.OK


def listed(_ctx: click.Context, _param: click.Parameter, given: str | None) -> list[str]:
    """Return the names in the value of an option that takes several, separated by commas (a click callback)."""
    return [] if given is None else [name.strip() for name in given.split(",") if name.strip()]
