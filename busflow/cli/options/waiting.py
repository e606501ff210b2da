"""The option `--wait` of commands that may be given before what they ask for is there, and the wait itself."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from math import inf
from typing import TYPE_CHECKING, Any, TypeVar

import click

from busflow.cli.options.launch_file import DurationType
from busflow.cli.options.run import joined
from busflow.cli.terminal.output import print_message
from busflow.clock import NS_PER_S, SystemClock, sleep
from busflow.errors import BusflowError, InspectionUnavailable, NoSuchRun

if TYPE_CHECKING:
    from busflow.wire.client.client import Peer

T = TypeVar("T")

_LOOK_S = 0.2
"""The interval at which to look whether it is there."""
_NO_LIMIT = "--wait=inf"


class _WaitType(DurationType):
    """The type of `--wait`: a duration, or `inf` for no limit."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | None:
        return inf if value == "inf" else super().convert(value, param, ctx)


wait_option: Callable[[Callable[..., Any]], Callable[..., Any]] = click.option(
    "--wait",
    "wait_s",
    type=_WaitType(),
    metavar="[DURATION]",
    help="Wait until the run and the name are there, no longer than this if it is given.",
)


class WaitingCommand(click.Command):
    """A command with `wait_option`, whose duration may be left out also before an argument."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Write `--wait` as an option without a limit unless a number follows, which no name begins with."""
        stated = list(args)
        for at, each in enumerate(args):
            if each == "--wait" and not "".join(args[at + 1 : at + 2]).lstrip(".")[:1].isdigit():
                stated[at] = _NO_LIMIT
        return super().parse_args(ctx, stated)


class Waiting:
    """The wait of one command, within one limit for everything that it waits for."""

    def __init__(self, limit_s: float | None) -> None:
        """Begin to wait; None for a command that does not wait."""
        self._clock = SystemClock()
        self._end_ns = None if limit_s is None else self._clock.monotonic_ns() + limit_s * NS_PER_S

    @contextmanager
    def joined(self, run: str | None) -> Generator[Peer]:
        """Join a run while the block lasts, as soon as it is there.

        Raises:
            NoSuchRun: There is none in time, or there are several and no name was given.
            InspectionUnavailable: It does not answer in time, or Zenoh is missing.
        """
        with ExitStack() as stack:
            yield self.until(lambda: stack.enter_context(joined(run)), NoSuchRun, InspectionUnavailable)

    def until(self, find: Callable[[], T], *missing: type[BusflowError]) -> T:
        """Return what `find` returns, as soon as it raises none of the errors `missing`.

        Raises:
            BusflowError: That error, if it does not end in time.
        """
        said = False
        while True:
            try:
                return find()
            except missing as error:
                if self._end_ns is None or (left_s := (self._end_ns - self._clock.monotonic_ns()) / NS_PER_S) <= 0:
                    raise
                if not said:
                    print_message(f"waiting: {error}")
                said = True
            sleep(min(_LOOK_S, left_s))
