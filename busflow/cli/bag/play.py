"""`busflow bag play`: publishes a recording, in a run of its own or into a running one."""

from __future__ import annotations

from typing import Any

import click

from busflow.cli.options.bag import reads, within
from busflow.cli.options.launch_file import DURATION
from busflow.cli.options.number import Number
from busflow.cli.options.run import complete_runs

_EXAMPLES = """\b
Examples:
  busflow bag play run.mcap
  busflow bag play run.mcap --rate 2 --start 10s --duration 5s --loop
  busflow bag play run.mcap --topics 'imu/*' --remap /imu/data:=/imu/old
  busflow bag play run.mcap --run lab1 --clock

\b
Keys, in a terminal:
  space  pause and go on    s or right  one message, while paused    up, down  10 % faster, slower"""

_CLOCK_HZ = "40"


def _remaps(ctx: click.Context, param: click.Parameter, given: tuple[str, ...]) -> dict[str, str]:
    """Return the topics to publish on instead, by recorded topic."""
    from busflow.bus.names import absolute_name, check_full_topic_name

    found: dict[str, str] = {}
    for each in given:
        old, separator, new = each.partition(":=")
        if not separator or not old or not new:
            raise click.BadParameter(f"{each!r} is not of the form /old:=/new", ctx, param)
        instead = absolute_name(new)
        check_full_topic_name(instead)
        found[absolute_name(old)] = instead
    return found


def _clock(ctx: click.Context, param: click.Parameter, given: str | None) -> float:
    """Return the frequency of /clock in Hz, 0 for never."""
    try:
        hz = float(given or 0)
    except ValueError:
        raise click.BadParameter(f"{given!r} is not a rate; write --clock=40, or FILE first", ctx, param) from None
    if given is not None and not 0 < hz <= 1e4:
        raise click.BadParameter(f"{given} Hz is not above 0 and up to 10000", ctx, param)
    return hz


@click.command(epilog=_EXAMPLES)
@reads()
@click.option("-r", "--rate", type=Number(0, 1e6, min_open=True), default=1.0, show_default=True,
              help="Seconds of the recording to play in a second.")  # fmt: skip
@within
@click.option("--until", "until_s", type=DURATION, hidden=True)  # ROS 2's word for --end
@click.option("--duration", "duration_s", type=DURATION, help="Play this much of the recording.")
@click.option("-l", "--loop", is_flag=True, help="Start again at the end, until Ctrl-C.")
@click.option("--topics", multiple=True, metavar="PATTERN", help="Only these (repeatable); imu/** is all below /imu.")
@click.option("-x", "--exclude", multiple=True, metavar="PATTERN", help="Not these (repeatable).")
@click.option(
    "-m", "--remap", "rename", multiple=True, metavar="OLD:=NEW", callback=_remaps, help="Publish on another topic."
)
@click.option("--clock", "clock_hz", metavar="[HZ]", is_flag=False, flag_value=_CLOCK_HZ, callback=_clock,
              help="Publish the recording's time on /clock, by default 40 times a second.")  # fmt: skip
@click.option("-p", "--start-paused", "paused", is_flag=True, help="Wait for the space key, or for the parameter.")
@click.option("-d", "--delay", "delay_s", type=DURATION, help="Wait for this time first.")
@click.option("--run", metavar="NAME", shell_complete=complete_runs, help="Play into this run; see busflow ps.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def play(
    until_s: float | None,
    end_s: float | None,
    run: str | None,
    as_json: bool,
    **asked: Any,
) -> int:
    """Publish the recording FILE: each message on its topic, with its QoS, in the recorded order and time.

    It is a run of its own, named after FILE, which other terminals can inspect; with --run it joins another run.
    A damaged or incomplete recording is played as far as it can be read, and the exit code is 5.
    """
    until_s = until_s if end_s is None else end_s
    start_s = asked["start_s"] or 0.0
    if until_s is not None and asked["duration_s"] is None and until_s <= start_s:
        raise click.UsageError(f"--end {until_s:g}s is not after --start {start_s:g}s: there is nothing between")
    asked |= {"start_s": start_s, "until_s": until_s, "delay_s": asked["delay_s"] or 0.0}
    asked |= {"topics": list(asked["topics"]), "exclude": list(asked["exclude"])}
    if run is None:
        from busflow.cli.bag.play_alone import play_alone

        return play_alone(asked, as_json=as_json)
    from busflow.cli.bag.play_into import play_into

    return play_into(run, asked, as_json=as_json)
