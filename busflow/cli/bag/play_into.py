"""`play_into`: plays a recording into a running graph: publishes the recorded bytes on the run's topics."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow.bus.qos import QoS
from busflow.cli.bag.play_alone import print_played, unplayed
from busflow.cli.options.bag import refuse_beyond_end
from busflow.cli.options.run import joined
from busflow.cli.terminal.output import print_message
from busflow.cli.terminal.player_console import Console, PlayerState
from busflow.clock import NS_PER_S, SystemClock
from busflow.errors import ExitCode, InvalidInput, Problem
from busflow.interfaces.encoding.builtin_types import builtin_types
from busflow.interfaces.encoding.description import rihs01
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.recording.bag.bag import Bag
from busflow.recording.bag.offered_qos import offered
from busflow.recording.player.ordered_messages import OrderedMessages, Span, chosen, playable, published_as
from busflow.recording.player.player import CLOCK
from busflow.recording.player.playing import Playing
from busflow.text import printable
from busflow.wire.zenoh.qos_text import to_text

if TYPE_CHECKING:
    from busflow.recording.bag.channel import Channel, Entry
    from busflow.wire.client.client import Peer
    from busflow.wire.client.graph_view import GraphView
    from busflow.wire.client.speaker import Speaker

_LOOK_S = 1.0
"""The interval at which to check that the run is alive."""
_CLOCK_TYPE = "rosgraph_msgs/msg/Clock"


def play_into(run: str, asked: Mapping[str, Any], *, as_json: bool) -> int:
    """Play a recording into a run; return the exit code.

    Raises:
        NoSuchRun: There is no run of this name.
        InvalidInput: One of its topics has another type.
        RunEnded: It ended meanwhile.
    """
    with Bag(asked["file"]) as bag, joined(run) as peer, ExitStack() as ends:
        refuse_beyond_end(bag, asked["start_s"])
        into = _Into(bag, peer, asked, ends)
        asyncio.run(into.go())
        if incomplete := bag.incomplete:
            print_message(f"warning: the recording is not the whole of what happened: {'; '.join(incomplete)}")
        hidden = unplayed(bag, asked)
        return print_played(into.played, Path(asked["file"]), incomplete, ExitCode.OK, hidden, as_json=as_json)


class _Into:
    """The ordered messages of a recording, and a speaker in the run for each of its topics."""

    def __init__(self, bag: Bag, peer: Peer, asked: Mapping[str, Any], ends: ExitStack) -> None:
        """Check everything, and advertise every topic, before anything is published."""
        self._peer, self._asked = peer, asked
        channels, faults = playable(
            chosen(bag.channels, asked["topics"], asked["exclude"], asked["rename"]), asked["rename"]
        )
        for fault in faults.values():
            print_message(f"warning: left out: {fault}")
        self._clock_hz: float = asked["clock_hz"]
        if self._clock_hz:
            channels = tuple(each for each in channels if each.topic != CLOCK)
        graph = peer.graph()
        for channel in channels:
            self._check(channel, graph)
        self._speakers = {each: self._advertised(each, ends) for each in channels}
        self._clock_speaker = self._advertised_clock(ends) if self._clock_hz else None
        peer.settle()
        ends.callback(peer.settle)  # before the topics end: what is published last arrives
        span = Span.of_seconds(asked["start_s"], asked["until_s"], asked["duration_s"])
        self._messages = OrderedMessages(bag, channels, span, threaded=True)
        self._playing: Playing | None = None

    @property
    def played(self) -> int:
        """The number of messages published so far."""
        return 0 if self._playing is None else self._playing.played

    async def go(self) -> None:
        """Play to the end, again and again with --loop."""
        try:
            await self._play()
        finally:
            await self._messages.close()

    async def _play(self) -> None:
        clock, asked = SystemClock(), self._asked
        if asked["delay_s"] > 0:
            await clock.sleep(asked["delay_s"])
        playing = self._playing = Playing(
            self._messages, clock, self._publish, rate=asked["rate"], paused=asked["paused"]
        )
        console = Console(_LoopControls(asyncio.get_running_loop(), playing))
        async with asyncio.TaskGroup() as beside:
            tasks = [beside.create_task(self._watch(clock, playing))]
            if self._clock_speaker is not None:
                tasks.append(beside.create_task(self._publish_clock(self._clock_speaker, clock, playing)))
            with console.shown():
                while await playing.play() and asked["loop"] and await playing.again():
                    continue
            for task in tasks:
                task.cancel()
            if self._clock_speaker is not None:
                self._publish_time(self._clock_speaker, playing)  # the final time
        self._peer.require_run()

    async def _publish(self, entry: Entry) -> None:
        self._speakers[entry.channel].publish_bytes(entry.payload)

    async def _watch(self, clock: SystemClock, playing: Playing) -> None:
        """Stop playing when the run has ended."""
        while self._peer.alive:
            await clock.sleep(_LOOK_S)
        playing.stop()

    async def _publish_clock(self, speaker: Speaker, clock: SystemClock, playing: Playing) -> None:
        while True:
            self._publish_time(speaker, playing)
            await clock.sleep(1 / self._clock_hz)

    @staticmethod
    def _publish_time(speaker: Speaker, playing: Playing) -> None:
        seconds, nanoseconds = divmod(max(0, playing.position_ns), NS_PER_S)
        speaker.publish({"clock": {"sec": seconds, "nanosec": nanoseconds}})

    def _topic(self, channel: Channel) -> str:
        return published_as(channel.topic, self._asked["rename"])

    def _check(self, channel: Channel, graph: GraphView) -> None:
        topic = self._topic(channel)
        there = graph.topics.get(topic)
        if there is not None and channel.type.name not in there.types:
            message = f"{topic} has the type {there.type} in the run, and was recorded as {channel.type.name}"
            fix = f"leave it out with --exclude {channel.topic}, or publish it elsewhere with --remap"
            raise InvalidInput(Problem("type", message, fix))
        if there is not None and there.publishers:
            print_message(f"warning: {printable(topic)} is published in the run too: its subscriptions receive both")

    def _advertised(self, channel: Channel, ends: ExitStack) -> Speaker:
        qos = to_text(offered(channel.qos) or QoS())
        return ends.enter_context(self._peer.advertise(self._topic(channel), channel.type, qos=qos, settle=False))

    def _advertised_clock(self, ends: ExitStack) -> Speaker:
        description = builtin_types().description(_CLOCK_TYPE)
        clock_type = ForeignType(_CLOCK_TYPE, rihs01(description), description)
        return ends.enter_context(self._peer.advertise(CLOCK, clock_type, settle=False))


class _LoopControls:
    """Controls of a player that runs on an event loop of this process."""

    def __init__(self, loop: asyncio.AbstractEventLoop, playing: Playing) -> None:
        self._loop, self._playing = loop, playing
        self._steps: set[asyncio.Task[bool]] = set()

    def shown(self) -> PlayerState:
        """Return the player's state."""
        return PlayerState.of(self._playing)

    def toggle(self) -> None:
        """Pause or resume."""
        clock = self._playing.clock
        self._call(clock.resume if clock.is_paused else clock.pause)

    def step(self) -> None:
        """Play one message, while paused."""
        self._call(self._step)

    def pace(self, factor: float) -> None:
        """Play faster or slower."""
        self._call(self._playing.clock.set_rate, self._playing.clock.rate * factor)

    def _call(self, act: Callable[..., object], *arguments: float) -> None:
        with suppress(RuntimeError):  # the loop has ended: everything is played
            self._loop.call_soon_threadsafe(act, *arguments)

    def _step(self) -> None:
        task = self._loop.create_task(self._playing.play_next())
        self._steps.add(task)
        task.add_done_callback(self._steps.discard)
