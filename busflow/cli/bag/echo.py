"""`busflow bag echo`: prints the messages of a recording as `busflow topic echo` prints those of a run."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING

import click

from busflow.cli.options.bag import named, print_damage, reads, stretch, within
from busflow.cli.options.message import wants
from busflow.cli.terminal.output import print_message
from busflow.errors import MalformedMessage

if TYPE_CHECKING:
    from pathlib import Path

    from busflow.cli.terminal.message_text import Printer, Wanted
    from busflow.recording.bag.bag import Bag
    from busflow.recording.bag.channel import Channel

_EXAMPLES = """\b
Examples:
  busflow bag echo run.mcap imu/data
  busflow bag echo run.mcap imu/data --start 10s --end 12s --field linear_acceleration.z
  busflow bag echo run.mcap balance_state --filter 'data > 0.5' --json
  busflow bag echo run.mcap joint_states --csv > joints.csv"""

_count = click.IntRange(1, sys.maxsize)
_MOST_WARNINGS = 20


@click.command(epilog=_EXAMPLES)
@reads()
@click.argument("topic")
@click.option("--once", is_flag=True, help="Stop after the first message.")
@click.option("-n", "--count", type=_count, metavar="N", help="Stop after N messages.")
@click.option("--last", type=_count, metavar="N", help="Print the last N messages.")
@within
@wants
@click.option("--json", "as_json", is_flag=True, help="Print each message as an object on a line of its own.")
def echo(
    file: Path,
    topic: str,
    once: bool,
    count: int | None,
    last: int | None,
    start_s: float | None,
    end_s: float | None,
    wanted: Wanted,
) -> int:
    """Print the messages of TOPIC that the recording FILE holds, as YAML.

    If the recording is damaged or cut off, everything before the damage is printed, and the exit code is 5.
    """
    from busflow.recording.bag.bag import Bag

    with Bag(file) as bag:
        channels = named([topic], bag)
        printers = {each: wanted.printer(each.topic, each.type) for each in channels}
        lines = _texts(bag, printers, stretch(bag, start_s, end_s))
        if last is not None:
            lines = deque(lines, last)
        for text in islice(lines, 1 if once else count):
            click.echo(text)
        return print_damage(bag)


def _texts(bag: Bag, printers: dict[Channel, Printer], times: tuple[int | None, int | None]) -> Iterator[str]:
    """Yield the messages as text; print a warning for messages that cannot be read."""
    from busflow.cli.terminal.field_paths import Absent
    from busflow.wire.client.listener import Received

    printed: set[str] = set()
    for entry in bag.entries(printers.__contains__, *times):
        received = Received(entry.payload, entry.sequence, entry.publish_time_ns, b"")
        try:
            text = printers[entry.channel](received)
        except (MalformedMessage, Absent) as error:
            if str(error) not in printed and len(printed) < _MOST_WARNINGS:
                printed.add(str(error))
                print_message(f"warning: message {entry.sequence} of {entry.channel.topic} is left out: {error}")
            continue
        if text is not None:
            yield text
