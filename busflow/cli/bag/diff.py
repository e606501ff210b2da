"""`busflow bag diff`: compares two recordings message by message."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.bag import listed, named, print_damage, reads
from busflow.cli.options.number import Number
from busflow.cli.terminal.output import outcome_printed, print_answer
from busflow.cli.terminal.progress import progress
from busflow.errors import ExitCode
from busflow.text import counted, printable

if TYPE_CHECKING:
    from pathlib import Path

    from busflow.recording.bag.bag import Bag
    from busflow.recording.tools.diff import BagDiff, TopicDifference

_EXAMPLES = """\b
Examples:
  busflow bag diff before.mcap after.mcap
  busflow bag diff a.mcap b.mcap --tolerance 1e-6 --topics balance_state,stability_index"""


@click.command(epilog=_EXAMPLES)
@reads("a")
@reads("b")
@click.option("--tolerance", type=Number(min=0), default=0.0,
              help="How far apart floating-point numbers may be.  [default: 0]")  # fmt: skip
@click.option("--topics", callback=listed, metavar="NAMES", help="Compare only these topics, separated by commas.")
@click.option("--times", is_flag=True, help="Also compare the times at which messages were recorded.")
@click.option(
    "--most", type=click.IntRange(min=1), default=3, help="Differing messages shown of a topic.  [default: 3]"
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def diff(a: Path, b: Path, tolerance: float, topics: list[str], times: bool, most: int, as_json: bool) -> int:
    """Compare the recordings A and B: on each topic the first message with the first, and so on.

    The exit code is 0 if they are the same, 3 if they differ, and 5 if one could not be read to its end.
    """
    from busflow.recording.bag.bag import Bag
    from busflow.recording.tools.diff import diff as compared
    from busflow.recording.tools.message_diff import Comparison

    with Bag(a) as left, Bag(b) as right, progress("comparing", None) as step:
        chosen = {each.topic for each in named(topics, left, right)} if topics else None
        found = compared(left, right, Comparison(tolerance), chosen, times=times, most=most, on_message=step)
        damaged = [print_damage(bag) for bag in (left, right)]
    with outcome_printed():
        if as_json:
            print_answer(_as_json(found, left, right))
        else:
            for topic in found.topics:
                _show(topic, left, right)
            verdict = "the same" if found.same else "different"
            click.echo(f"{verdict}: {_pairs(found.messages)} compared (topics: {len(found.topics)})")
    return ExitCode.DIFFERENT if not found.same else max(damaged)


def _show(topic: TopicDifference, left: Bag, right: Bag) -> None:
    name = printable(topic.topic)
    for bag, kind in ((left, topic.left_type), (right, topic.right_type)):
        if kind is None:
            click.echo(f"{name} is not in {bag.path}")
            return
    if topic.left_type != topic.right_type:
        click.echo(
            f"{name} is {printable(topic.left_type)} in {left.path}, {printable(topic.right_type)} in {right.path}"
        )
    if topic.left != topic.right:
        click.echo(f"{name} has {counted(topic.left, 'message')} in {left.path}, {topic.right} in {right.path}")
    if not topic.different:
        return
    both = min(topic.left, topic.right)
    if both == 1:
        click.echo(f"{name}: its message differs")
    else:
        click.echo(f"{name}: {topic.different} of {both} messages {'differs' if topic.different == 1 else 'differ'}")
    for each in topic.first:
        click.echo(f"  message {each.number}, at {each.left_ns / 1e9:.3f} s")
        for field in each.fields:
            click.echo(f"    {printable(field)}")
    if topic.different > len(topic.first):
        click.echo(f"  … and {topic.different - len(topic.first)} more")


def _pairs(count: int) -> str:
    return "no messages were" if count == 0 else counted(count, "message was", "messages were")


def _as_json(found: BagDiff, left: Bag, right: Bag) -> dict[str, Any]:
    return {
        "same": found.same,
        "messages": found.messages,
        "a": {"path": str(left.path), "damage": left.damage and str(left.damage)},
        "b": {"path": str(right.path), "damage": right.damage and str(right.damage)},
        "topics": [
            {
                "name": each.topic,
                "same": each.same,
                "types": [each.left_type, each.right_type],
                "messages": [each.left, each.right],
                "different": each.different,
                "first": [
                    {
                        "number": message.number,
                        "since_start_ns": [message.left_ns, message.right_ns],
                        "fields": [{"path": one.path, "a": one.left, "b": one.right} for one in message.fields],
                    }
                    for message in each.first
                ],
            }
            for each in found.topics
        ],
    }
