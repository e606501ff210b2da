"""`busflow bag record`: records topics of a running graph into a file, until Ctrl-C."""

from __future__ import annotations

import signal
import threading
from typing import TYPE_CHECKING

import click

from busflow.bus.names import absolute_name
from busflow.cli.options.bag import SIZE
from busflow.cli.options.launch_file import DURATION
from busflow.cli.options.run import complete_runs, complete_topics, joined
from busflow.cli.terminal.output import print_answer, print_message
from busflow.errors import ExitCode
from busflow.text import counted, printable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from busflow.processes.remote_recorder import RemoteRecorder
    from busflow.wire.client.client import Peer

_EXAMPLES = """\b
Examples:
  busflow bag record --all
  busflow bag record -o run.mcap imu/data '/arm/**'
  busflow bag record --regex '/(left|right)/image.*' --exclude-regex depth
  busflow bag record -o 'runs/{name}-{start}.mcap' --all --exclude '/camera/*' --for 1min"""

_DATED = "{name}-{start}.mcap"
_EXCLUDE_TOPICS = "--exclude-topics"

_LOOK_S = 1.0
"""The interval at which to look for new topics, and to check that the run is alive."""


class _RecordCommand(click.Command):
    """A command whose `--exclude-topics` takes several names, as in ROS 2."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Give each name after `--exclude-topics` an option of its own, lest it be a topic to record."""
        stated: list[str] = []
        excluded: int | None = None
        for each in args:
            if each.startswith("-"):
                excluded = 0 if each == _EXCLUDE_TOPICS else None
            elif excluded is not None:
                stated += [_EXCLUDE_TOPICS] if excluded else []
                excluded += 1
            stated.append(each)
        return super().parse_args(ctx, stated)


@click.command(cls=_RecordCommand, epilog=_EXAMPLES)
@click.argument("topics", metavar="[TOPIC]...", nargs=-1, shell_complete=complete_topics)
@click.option("-a", "--all", "everything", is_flag=True, help="All topics that are not hidden.")
@click.option("--topics", "named", multiple=True, metavar="TOPIC...", shell_complete=complete_topics,
              help="The same as TOPIC alone.")  # fmt: skip
@click.option("-e", "--regex", "regexes", multiple=True, metavar="REGEX", help="Topics whose names contain this.")
@click.option("-o", "--output", default=_DATED, show_default=True, metavar="FILE", help="The file.")
@click.option("--exclude", _EXCLUDE_TOPICS, multiple=True, metavar="PATTERN", help="Leave these topics out.")
@click.option("--exclude-regex", "exclude_regexes", multiple=True, metavar="REGEX",
              help="Leave topics out whose names contain this.")  # fmt: skip
@click.option("-b", "--max-bag-size", "size", type=SIZE, metavar="SIZE", help="Go on in another file at 500MB, 1GiB.")
@click.option("-d", "--max-bag-duration", "duration_s", type=DURATION, help="Go on in another file after this time.")
@click.option("--for", "for_s", type=DURATION, help="Stop after this time: 5s, 10min.")
@click.option("--compression", type=click.Choice(["zstd", "lz4", "none"]), default="zstd", show_default=True)
@click.option(
    "--on-drop", type=click.Choice(["warn", "fail"]), default="warn", show_default=True, help="fail: exit code 5."
)
@click.option("--run", metavar="NAME", shell_complete=complete_runs, help="The run, where there are several.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON at the end.")
def record(
    topics: tuple[str, ...],
    everything: bool,
    named: tuple[str, ...],
    regexes: tuple[str, ...],
    output: str,
    exclude: tuple[str, ...],
    exclude_regexes: tuple[str, ...],
    size: int | None,
    duration_s: float | None,
    for_s: float | None,
    compression: str,
    on_drop: str,
    run: str | None,
    as_json: bool,
) -> int:
    """Record the topics TOPIC of a running graph, by names or patterns such as /arm/**, until Ctrl-C.

    In FILE {name} stands for the run's name, and {start} for the time in UTC. With -b or -d it is a directory of files.
    Messages that are lost on the way are counted, and make the recording incomplete. The exit code is 4 if there was no
    such topic, and 1 if nothing was published. busflow run --record misses nothing and holds more: calls, ticks, every
    change of a parameter, the launch file.
    """
    if bool(topics or named or regexes) == everything:
        raise click.UsageError("name the topics to record, or give --all")
    from busflow.bus.patterns import Selection
    from busflow.launchfile.model.description import Compression, Split

    split = None if size is None and duration_s is None else Split(size, duration_s)
    selection = Selection((*topics, *named), exclude, regexes=regexes, exclude_regexes=exclude_regexes)
    with joined(run) as peer:
        from busflow.processes.remote_recorder import RemoteRecorder

        recorder = RemoteRecorder(peer, selection, to=output, compression=Compression(compression), split=split)
        try:
            code = _listen(peer, recorder, for_s)
        finally:
            recorder.close()
    _print_result(recorder, as_json=as_json)
    if on_drop == "fail" and not recorder.complete:
        return ExitCode.INCOMPLETE
    if code is ExitCode.OK and not recorder.published and recorder.complete:
        return ExitCode.FAILED if recorder.topics else ExitCode.NOT_FOUND
    return code


def _listen(peer: Peer, recorder: RemoteRecorder, for_s: float | None) -> ExitCode:
    """Record until the run ends, a signal comes, or the time is over; return the exit code."""
    from busflow.cli.bag.signal_handling import handled
    from busflow.clock import SystemClock
    from busflow.runner.signals import CODES, ending_signals

    clock, code, over = SystemClock(), ExitCode.OK, threading.Event()

    def end(number: int, _frame: object) -> None:
        nonlocal code
        code = CODES[signal.Signals(number)]
        over.set()

    with handled(ending_signals(), end):
        recorder.follow()
        shown = ", ".join(map(printable, recorder.topics)) or "nothing yet"
        print_message(f"recording {shown} to {printable(recorder.path)}; Ctrl-C ends it")
        _warn_of_missing(peer, recorder.unmatched)
        while recorder.failure is None and peer.alive:
            left_s = _LOOK_S if for_s is None else min(_LOOK_S, for_s - clock.seconds())
            if left_s <= 0 or over.wait(left_s):
                break
            recorder.follow()
    return code


def _warn_of_missing(peer: Peer, patterns: Sequence[str]) -> None:
    """Warn at once of topics that nothing publishes: a mistyped name is noticed before the recording is over."""
    from busflow.text import did_you_mean
    from busflow.wire.client.graph_view import view

    names = [each.name for each in view(peer.tokens(), []).topics.values() if each.publishers] if patterns else []
    for pattern in patterns:
        near = did_you_mean(absolute_name(pattern), names)
        print_message(f"warning: nothing publishes {printable(pattern)} so far{f'; {printable(near)}' if near else ''}")


def _print_result(recorder: RemoteRecorder, *, as_json: bool) -> None:
    for pattern in recorder.unmatched:
        print_message(f"warning: there was no topic {printable(pattern)}")
    for topic, why in recorder.unavailable.items():
        print_message(f"warning: nothing of {printable(topic)} was recorded: {why}")
    if recorder.failure is not None:
        print_message(f"error: nothing more could be written: {printable(recorder.failure)}")
    if as_json:
        result = {"file": str(recorder.path), "recorded": recorder.recorded, "missed": recorder.missed}
        result |= {"heard": recorder.published, "nodes": recorder.nodes}
        print_answer({**result, "complete": recorder.complete, "topics": sorted(recorder.topics)})
        return
    if not recorder.published and recorder.complete:
        topics = counted(len(recorder.topics), "topic")
        why = f"nothing was published on {topics}" if recorder.topics else "there was no topic to record"
        print_message(f"{printable(recorder.path)}: nothing was recorded: {why}", error_stream=False)
        return
    state = "complete" if recorder.complete else f"INCOMPLETE, {recorder.missed} missed"
    shown = f"{counted(recorder.published, 'message')} of {counted(len(recorder.topics), 'topic')}"
    shown += f" and the parameters of {counted(recorder.nodes, 'node')}" if recorder.nodes else ""
    print_message(f"{printable(recorder.path)}: {shown} recorded, {state}", error_stream=False)
