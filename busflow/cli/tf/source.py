"""The source of frames for the verbs of `busflow tf`: a run, or a recording with `--bag`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.run import complete_runs, joined
from busflow.errors import BagError, MalformedMessage
from busflow.frames.seen import SeenFrames
from busflow.wire.client.frames import FIXED, MOVING, FramesMessage, follow_frames

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag


def of_run_or_bag(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options `--run` and `--bag` to a command."""
    bag = click.option(
        "--bag", type=click.Path(exists=True, path_type=Path), metavar="FILE", help="Read this recording, not a run."
    )
    run = click.option(
        "--run", metavar="NAME", shell_complete=complete_runs, help="Only this run, where there are several."
    )
    return bag(run(command))


def followed(run: str | None, bag: Path | None, for_s: float | None) -> Iterator[FramesMessage | None]:
    """Yield the transforms of a recording, or of a run as they come, for some time; None while nothing comes.

    Raises:
        click.UsageError: both a run and a recording are given.
        BagError: the recording has no frames, or none that can be read.
    """
    if bag is None:
        with joined(run) as peer:
            yield from follow_frames(peer, peer.graph(), for_s)
        return
    if run is not None:
        raise click.UsageError("--run is for graphs that run, which --bag is not")
    from busflow.recording.bag import Bag

    with Bag(bag) as opened:
        yield from _recorded(opened)


def _recorded(bag: Bag) -> Iterator[FramesMessage]:
    from busflow.msgs.tf2_msgs import TFMessage

    channels = {each: each.topic == FIXED for each in bag.channels if each.topic in (MOVING, FIXED)}
    if not channels:
        known = ", ".join(sorted({each.topic for each in bag.channels})[:8])
        raise BagError(f"the recording has no {MOVING} and no {FIXED}", fix=f"record them too; it has {known}")
    for entry in bag.entries(channels.__contains__):
        try:
            message = entry.channel.decode(entry.payload, TFMessage)
        except MalformedMessage:
            continue
        yield FramesMessage(message, entry.channel.publisher_names, entry.publish_time_ns, channels[entry.channel])


def gathered(run: str | None, bag: Path | None, for_s: float) -> SeenFrames:
    """Return the frames of a whole recording, or those that come from a run in some seconds."""
    seen = SeenFrames()
    for each in followed(run, bag, for_s):
        if each is not None:
            seen.add(each.message, each.publishers, each.published_ns, fixed=each.fixed)
    return seen
