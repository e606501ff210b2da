"""`busflow tf echo`: prints the transform between two frames of a run or a recording."""

from __future__ import annotations

import json
from math import asin, atan2, degrees
from pathlib import Path
from typing import TYPE_CHECKING

import click

from busflow.cli.options.launch_file import DURATION
from busflow.cli.terminal.output import print_line, print_message
from busflow.cli.tf.source import followed, of_run_or_bag
from busflow.clock import NS_PER_S, monotonic
from busflow.errors import ExitCode
from busflow.frames.seen import SeenFrames
from busflow.frames.tree import Gap

if TYPE_CHECKING:
    from busflow.frames.rigid import Rigid

_EXAMPLES = """\b
Examples:
  busflow tf echo map base_link
  busflow tf echo odom imu_link --once
  busflow tf echo map base_link --bag run.mcap --period 100ms --json"""


@click.command(epilog=_EXAMPLES)
@click.argument("target")
@click.argument("source")
@of_run_or_bag
@click.option("--once", is_flag=True, help="Stop after the first.")
@click.option("-n", "--count", type=click.IntRange(min=1), metavar="N", help="Stop after N.")
@click.option("--period", "period_s", type=DURATION, default="1s", show_default=True, help="The time between two.")
@click.option(
    "--timeout", "timeout_s", type=DURATION, default="5s", show_default=True, help="How long to wait for one."
)
@click.option("--json", "as_json", is_flag=True, help="Print each as an object on a line of its own.")
def echo(
    target: str,
    source: str,
    run: str | None,
    bag: Path | None,
    once: bool,
    count: int | None,
    period_s: float,
    timeout_s: float,
    as_json: bool,
) -> int:
    """Print where the frame SOURCE is, seen from TARGET: the transform that gives coordinates in TARGET.

    The newest is printed, every second; of a recording one for each second of its stamps. Without one for the
    timeout the reason is printed, and the exit code is 1.
    """
    seen, shown, last_ns = SeenFrames(), 0, None
    most, printed_at = 1 if once else count, monotonic()
    for each in followed(run, bag, None):
        if each is not None:
            seen.add(each.message, each.publishers, each.published_ns, fixed=each.fixed)
        found = seen.tree.find(target, source, None)
        if isinstance(found, Gap):
            if bag is None and monotonic() > printed_at + timeout_s:
                break
            continue
        rigid, stamp_ns = found
        is_due = last_ns is None or not last_ns <= stamp_ns < last_ns + period_s * 1e9
        if is_due:
            _show(target, source, rigid, stamp_ns, as_json=as_json)
            shown, last_ns, printed_at = shown + 1, stamp_ns, monotonic()
        if shown == most:
            return ExitCode.OK
    if shown:
        return ExitCode.OK
    missing = seen.tree.find(target, source, None)
    reason = seen.tree.error(missing, (target, source)) if isinstance(missing, Gap) else "nothing came"
    print_message(f"error: {reason}")
    return ExitCode.FAILED


def _show(target: str, source: str, rigid: Rigid, stamp_ns: int, *, as_json: bool) -> None:
    x, y, z, qx, qy, qz, qw = rigid
    angles = rpy(rigid)
    if as_json:
        place = {"xyz": [x, y, z], "quaternion": [qx, qy, qz, qw], "rpy": list(angles)}
        print_line({"target": target, "source": source, "stamp_ns": stamp_ns, **place})
        return
    when = f"{stamp_ns // NS_PER_S}.{stamp_ns % NS_PER_S:09}" if stamp_ns else "any time"
    rows = {
        "translation": (x, y, z),
        "quaternion": (qx, qy, qz, qw),
        "rpy": angles,
        "rpy_degrees": tuple(map(degrees, angles)),
    }
    shown = "\n".join(
        f"{name}: {json.dumps([round(each, 6) + 0.0 for each in values])}" for name, values in rows.items()
    )
    click.echo(f"at: {when}\n{shown}\n---")


def rpy(rigid: Rigid) -> tuple[float, float, float]:
    """Return the rotation of a motion as roll, pitch and yaw about fixed axes."""
    *_, x, y, z, w = rigid
    sine = max(-1.0, min(1.0, 2 * (w * y - z * x)))
    roll = atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return roll, asin(sine), atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
