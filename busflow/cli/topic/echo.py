"""`busflow topic echo`: prints the messages of a topic as they arrive, or the last kept ones."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from busflow.cli.options.interfaces import takes_interfaces
from busflow.cli.options.launch_file import DURATION
from busflow.cli.options.message import wants
from busflow.cli.options.run import complete_topics, complete_types, joins
from busflow.cli.options.waiting import Waiting, WaitingCommand, wait_option
from busflow.errors import ExitCode, NoSuchTarget, UnknownType

if TYPE_CHECKING:
    from busflow.cli.terminal.message_text import Wanted

_EXAMPLES = """\b
Examples:
  busflow topic echo imu/data
  busflow topic echo imu/data --once --wait 10s
  busflow topic echo imu/data --field linear_acceleration.z
  busflow topic echo imu/data --filter 'linear_acceleration.z > 9.9'
  busflow topic echo balance_state --last 5
  busflow topic echo joint_states --csv > joints.csv"""

_count = click.IntRange(min=1)


@click.command(cls=WaitingCommand, epilog=_EXAMPLES)
@click.argument("name", shell_complete=complete_topics)
@click.argument("type_name", metavar="[TYPE]", required=False, shell_complete=complete_types)
@click.option("--once", is_flag=True, help="Stop after the first message.")
@click.option("-n", "--count", type=_count, metavar="N", help="Stop after N messages.")
@click.option("--last", type=_count, metavar="N", help="Print the last N messages that are kept, and stop.")
@click.option(
    "--timeout",
    "timeout_s",
    type=DURATION,
    help="Stop with exit code 1 when nothing was printed for this time.",
)
@wait_option
@click.option(
    "--include-message-info",
    "with_info",
    is_flag=True,
    help="Print times and number of each message before it. --json always has them.",
)
@wants
@takes_interfaces
@joins
def echo(
    run: str | None,
    name: str,
    type_name: str | None,
    once: bool,
    count: int | None,
    last: int | None,
    timeout_s: float | None,
    wait_s: float | None,
    with_info: bool,
    wanted: Wanted,
) -> int:
    """Print the messages of the topic NAME, as YAML, until Ctrl-C.

    With TYPE the topic need not be there yet, as with ROS 2: its first message is printed when it comes.
    With --json each message is an object on a line of its own, and nothing is cut unless --truncate-length is given.
    """
    from busflow.cli.terminal.message_text import TextForm
    from busflow.cli.topic.echoing import Echo, found_topic, warn_if_unpublished

    waiting, with_info = Waiting(wait_s), with_info and wanted.form is not TextForm.JSON
    with waiting.joined(run) as peer:
        graph, topic, type_ = waiting.until(lambda: found_topic(peer, name, type_name), NoSuchTarget, UnknownType)
        echoed = Echo(peer, topic, type_, wanted, with_info=with_info)
        if last is not None:
            echoed.show_last(last)
            return ExitCode.OK
        warn_if_unpublished(graph, topic)
        return echoed.follow(1 if once else count, timeout_s, demand_field=once)
