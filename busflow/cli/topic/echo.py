"""`busflow topic echo`: prints the messages of a topic as they come, or the last ones that are kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from busflow.cli.joining import complete_topics, complete_types, joined, joins
from busflow.cli.launching import duration
from busflow.errors import ExitCode

if TYPE_CHECKING:
    pass

_EXAMPLES = """\b
Examples:
  busflow topic echo imu/data
  busflow topic echo imu/data --once
  busflow topic echo imu/data --field linear_acceleration.z
  busflow topic echo imu/data --filter 'linear_acceleration.z > 9.9'
  busflow topic echo balance_state --last 5
  busflow topic echo joint_states --csv > joints.csv"""

_count = click.IntRange(min=1)


@click.command(epilog=_EXAMPLES)
@click.argument("name", shell_complete=complete_topics)
@click.argument("type_name", metavar="[TYPE]", required=False, shell_complete=complete_types)
@click.option("--once", is_flag=True, help="Stop after the first message.")
@click.option("-n", "--count", type=_count, metavar="N", help="Stop after N messages.")
@click.option("--last", type=_count, metavar="N", help="Print the last N messages that are kept, and stop.")
@click.option("--field", metavar="PATH", help="Print only this part: linear_acceleration.z, position[0].")
@click.option("--filter", "filter_", metavar="EXPR", help="Print only messages for which this is true: m.data > 0.5.")
@click.option(
    "--timeout",
    "timeout_s",
    metavar="DURATION",
    callback=duration,
    help="Stop with exit code 1 when nothing was printed for so long.",
)
@click.option("--csv", is_flag=True, help="Print the values of a message on a line, with commas between them.")
@click.option("--raw", is_flag=True, help="Print the bytes as they travel.")
@click.option("--flow-style", is_flag=True, help="Print each sequence on one line.")
@click.option("--no-arr", is_flag=True, help="Of a sequence, print its type and length only.")
@click.option("--no-str", is_flag=True, help="Of a text, print its length only.")
@click.option("-f", "--full-length", is_flag=True, help="Print long sequences and texts to their end.")
@click.option(
    "-l", "--truncate-length", type=click.IntRange(min=0), help="Where to cut sequences and texts.  [default: 128]"
)
@joins
def echo(
    run: str | None,
    name: str,
    type_name: str | None,
    once: bool,
    count: int | None,
    last: int | None,
    field: str | None,
    filter_: str | None,
    timeout_s: float | None,
    csv: bool,
    raw: bool,
    flow_style: bool,
    no_arr: bool,
    no_str: bool,
    full_length: bool,
    truncate_length: int | None,
    as_json: bool,
) -> int:
    """Print the messages of the topic NAME, as YAML, until Ctrl-C.

    With --json each message is an object on a line of its own, and nothing is cut unless --truncate-length is given.
    """
    from busflow.cli.topic.abridged import TRUNCATED_AFTER, Abridger
    from busflow.cli.topic.echoing import Echo
    from busflow.cli.topic.printing import Form, Wanted

    forms = {Form.CSV: csv, Form.RAW: raw, Form.FLOW: flow_style, Form.JSON: as_json}
    chosen = [form for form, given in forms.items() if given] or [Form.YAML]
    if len(chosen) > 1:
        raise click.UsageError("--csv, --raw, --flow-style and --json exclude each other")
    if raw and field:
        raise click.UsageError("--raw prints whole messages; leave --field out")
    whole = full_length or (as_json and truncate_length is None)
    abridger = Abridger(
        None if whole else TRUNCATED_AFTER if truncate_length is None else truncate_length, no_arr, no_str
    )
    wanted = Wanted(chosen[0], abridger, field, filter_)
    with joined(run) as peer:
        echoed = Echo(peer, name, type_name, wanted)
        if last is not None:
            echoed.show_last(last)
            return ExitCode.OK
        return echoed.follow(1 if once else count, timeout_s)
