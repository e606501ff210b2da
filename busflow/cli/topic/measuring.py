"""`busflow topic hz`, `bw` and `delay`: print measurements that the run makes where messages are published."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from busflow.cli.options.interfaces import takes_interfaces
from busflow.cli.options.launch_file import DURATION
from busflow.cli.options.run import complete_topics, joins
from busflow.cli.options.waiting import Waiting, WaitingCommand, wait_option

_count = click.IntRange(min=1)


def _options(command: Callable[..., int]) -> Callable[..., Any]:
    for option in (
        click.argument("names", metavar="NAME...", nargs=-1, required=True, shell_complete=complete_topics),
        click.option("-w", "--window", type=_count, metavar="N", help="The most messages in a window."),
        click.option("-n", "--count", type=_count, metavar="N", help="Stop after N measurements."),
        click.option(
            "--every",
            "every_s",
            type=DURATION,
            default="1s",
            show_default=True,
            help="The interval between two measurements.",
        ),
        wait_option,
        joins,
        takes_interfaces,
    ):
        command = option(command)
    return command


@click.command(
    cls=WaitingCommand,
    epilog="\b\nExamples:\n  busflow topic hz imu/data\n  busflow topic hz imu/data joint_states -n 3",
)
@_options
def hz(**options: Any) -> int:
    """Measure how often each topic NAME is published, until Ctrl-C.

    The run counts each message where it is published, so the rate is exact, however high it is. Subscriptions that
    dropped messages in the interval are named.
    """
    return _measure("HZ", **options)


@click.command(cls=WaitingCommand, epilog="\b\nExample:\n  busflow topic bw image_raw")
@_options
def bw(**options: Any) -> int:
    """Measure how many bytes a second each topic NAME carries, until Ctrl-C.

    The size of a message is that of its encoding for other processes. The run has to encode it to measure that.
    """
    return _measure("BW", **options)


@click.command(cls=WaitingCommand, epilog="\b\nExample:\n  busflow topic delay imu/data")
@_options
def delay(**options: Any) -> int:
    """Measure how old the messages of each topic NAME are when they are published, until Ctrl-C.

    Their age is the time since the stamp of their header, by the run's clock.
    """
    return _measure("DELAY", **options)


def _measure(name: str, *, run: str | None, names: tuple[str, ...], wait_s: float | None, **options: Any) -> int:
    """Print the measure with this name in `rates` for each topic."""
    from busflow.cli.topic import rates
    from busflow.cli.topic.gauges import gauge

    waiting = Waiting(wait_s)
    with waiting.joined(run) as peer:
        return gauge(peer, names, getattr(rates, name), waiting, **options)
