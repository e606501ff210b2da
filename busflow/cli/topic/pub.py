"""`busflow topic pub`: publishes messages on a topic of a running graph."""

from __future__ import annotations

import sys
from typing import BinaryIO

import click

from busflow.cli.options.interfaces import takes_interfaces
from busflow.cli.options.number import Number
from busflow.cli.options.run import complete_topics, complete_types, joined, joins
from busflow.cli.terminal.output import print_message

_EXAMPLES = """\b
Examples:
  busflow topic pub --once joint_command std_msgs/msg/Float64 '{data: 0.5}'
  busflow topic pub -r 10 imu/data sensor_msgs/msg/Imu '{header: auto, linear_acceleration: {z: 9.8}}'
  busflow topic pub --stdin -r 50 joint_command std_msgs/msg/Float64 < commands.jsonl"""

_count = click.IntRange(min=1)


@click.command(epilog=_EXAMPLES)
@click.argument("name", shell_complete=complete_topics)
@click.argument("type_name", metavar="TYPE", shell_complete=complete_types)
@click.argument("values", required=False, metavar="[VALUES]")
@click.option("--stdin", "from_stdin", is_flag=True, help="Publish each line of standard input, as YAML or JSON.")
@click.option("-1", "--once", is_flag=True, help="Publish one message and stop.")
@click.option("-t", "--times", type=_count, metavar="N", help="Publish N messages and stop.")
@click.option("-r", "--rate", type=Number(min=1e-9),
              help="Messages a second.  [default: 1; with --stdin as they come]")  # fmt: skip
@click.option(
    "-w",
    "--wait-matching-subscriptions",
    "matches",
    type=click.IntRange(min=0),
    metavar="N",
    help="Wait for N subscriptions.  [default: 1 with --once, --times or --stdin, else 0]",
)
@click.option(
    "--max-wait-time-secs",
    "patience_s",
    type=Number(min=0),
    metavar="S",
    help="Stop waiting for subscriptions after so many seconds, with exit code 1.",
)
@click.option("--qos-depth", type=click.IntRange(1, 2**31 - 1), metavar="N",
              help="The number of messages kept for late subscriptions.")  # fmt: skip
@click.option("--qos-reliability", type=click.Choice(["reliable", "best_effort"]), help="What is offered.")
@click.option("--qos-durability", type=click.Choice(["volatile", "transient_local"]), help="What is offered.")
@click.option("-p", "--print", "print_every", type=_count, default=1, metavar="N", help="Show only every Nth message.")
@takes_interfaces
@joins
def pub(
    run: str | None,
    name: str,
    type_name: str,
    values: str | None,
    from_stdin: bool,
    once: bool,
    times: int | None,
    rate: float | None,
    matches: int | None,
    patience_s: float | None,
    qos_depth: int | None,
    qos_reliability: str | None,
    qos_durability: str | None,
    print_every: int,
    as_json: bool,
) -> int:
    """Publish messages of TYPE on the topic NAME, until Ctrl-C, or until the end of standard input.

    VALUES is YAML; fields that it leaves out have their defaults. A header may be `auto` and a time `now`: each
    message then gets the time of its publication. QoS that is not given follows what the topic's subscriptions ask for.
    """
    from busflow.cli.topic.publishing import Publishing
    from busflow.wire.client.offer import Offer

    if once and times is not None:
        raise click.UsageError("--once and --times exclude each other")
    if from_stdin and values is not None:
        raise click.UsageError("--stdin reads the values: leave VALUES out")
    limit = 1 if once else times
    pace = rate if rate is not None or from_stdin else 1.0
    with joined(run) as peer:
        offer = Offer(qos_depth, qos_reliability, qos_durability)
        given = _stdin() if from_stdin else values or "{}"
        publishing = Publishing(peer, name, type_name, given, offer, print_every=print_every, as_json=as_json)
        enough = matches if matches is not None else int(limit is not None or from_stdin)
        return publishing.go(pace, limit, enough, patience_s)


def _stdin() -> BinaryIO:
    """Return standard input; at a terminal, say what it waits for."""
    if not sys.stdin:  # the shell closed it: `<&-`
        raise click.UsageError("--stdin: there is no standard input")
    if sys.stdin.isatty():
        print_message("info: write one message a line; Ctrl-D ends")
    return sys.stdin.buffer
