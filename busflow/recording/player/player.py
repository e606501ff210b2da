"""Player: the node that publishes the messages of a recording, on their topics and in their time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import Field

from busflow.bus.publisher import Publisher
from busflow.clock import Time
from busflow.errors import BagError, MalformedMessage, NotRunning
from busflow.msgs.rosgraph_msgs import Clock
from busflow.msgs.std_srvs import Trigger
from busflow.node.handlers import on_parameters, service
from busflow.node.node import Node, runtime_of
from busflow.node.parameters import Parameters, ReadOnly
from busflow.recording.bag.bag import Bag
from busflow.recording.bag.channel import Channel, Entry
from busflow.recording.bag.offered_qos import offered
from busflow.recording.bag.series import Damage
from busflow.recording.player.message_classes import MessageClasses
from busflow.recording.player.ordered_messages import OrderedMessages, Span, chosen, playable, published_as
from busflow.recording.player.playing import Playing

CLOCK = "/clock"


class PlayerParameters(Parameters):
    """Parameters of a playback."""

    file: ReadOnly[Path] = Field(description="The recording: an MCAP file, or a bag of rosbag2.")
    rate: float = Field(default=1.0, gt=0, le=1e6, description="Seconds of the recording in a second of the run.")
    paused: bool = Field(default=False, description="Whether its time stands still.")
    loop: bool = Field(default=False, description="Begin anew at the end.")
    start_s: ReadOnly[float] = Field(default=0.0, description="Where to begin, seconds after the first message.")
    until_s: ReadOnly[float | None] = Field(default=None, ge=0, description="Where to end, counted like start_s.")
    duration_s: ReadOnly[float | None] = Field(default=None, ge=0, description="How long to play from start_s on.")
    delay_s: ReadOnly[float] = Field(default=0.0, description="How long to wait before the first message.")
    topics: ReadOnly[list[str]] = Field(default=[], description="Only these topics, or regular expressions.")
    exclude: ReadOnly[list[str]] = Field(default=[], description="Without these topics, or regular expressions.")
    rename: ReadOnly[dict[str, str]] = Field(default={}, description="By topic, the one to publish on instead.")
    clock_hz: ReadOnly[float] = Field(default=0.0, ge=0, le=1e4, description="How often to publish /clock; 0 is never.")


class Player(Node):
    """Publishes a recording: every message on its topic, with the recorded QoS, in its order and time."""

    parameters: PlayerParameters
    playing: Playing | None = None
    """The playback, once it has started; a terminal may ask before anything is declared."""

    def declare(self) -> None:
        """Offer what the recording has: its topics are known from the file alone."""
        asked = self.parameters
        self.damage: Damage | None = None
        self.refused: dict[str, int] = {}
        """The number of messages that could not be read, by topic."""
        self._bag = Bag(asked.file)
        self._classes = MessageClasses()
        self._outputs: dict[Channel, tuple[Publisher[Any], Callable[[bytes], Any]]] = {}
        """By channel, the publisher of its messages, and the function that decodes them."""
        channels, faults = playable(
            chosen(self._bag.channels, asked.topics, [*asked.exclude], asked.rename), asked.rename
        )
        self.channels: tuple[Channel, ...] = channels
        for channel, fault in faults.items():
            self.log.warning("a topic cannot be published and is left out", topic=channel.topic, reason=str(fault))
        if asked.clock_hz:
            self.channels = tuple(each for each in self.channels if each.topic != CLOCK)
            self._clock = self.create_publisher(Clock, CLOCK)
            self.create_timer(hz=asked.clock_hz, handler=self.publish_time)
        for channel in self.channels:
            self._offer(channel)

    def _offer(self, channel: Channel) -> None:
        same = next((known for known in self._outputs if channel.topic == known.topic), None)
        if same is not None and (channel.type_name, channel.type_hash) == (same.type_name, same.type_hash):
            self._outputs[channel] = self._outputs[same]  # of another process, which has offered another QoS
            return
        if same is not None:
            raise BagError(
                f"{channel.topic} has two types in {self.parameters.file}", fix="leave the topic out: exclude"
            )
        cls = self._classes.find(channel)
        topic = published_as(channel.topic, self.parameters.rename)
        publisher = self.create_publisher(cls, topic, qos=offered(channel.qos))
        self._outputs[channel] = publisher, lambda payload: channel.decode(payload, cls)

    async def start(self) -> None:
        """Find the beginning of what is to be played."""
        if getattr(asyncio.get_running_loop(), "follows", False):
            raise NotRunning(
                "a run whose clock follows /clock cannot play what says how late it is: play from a run of its own, "
                "with busflow bag play --clock --run NAME"
            )
        asked = self.parameters
        if asked.start_s < 0:
            self.log.warning("a start before the first message is the first message", start_s=asked.start_s)
        if asked.delay_s < 0:
            self.log.warning("a delay below zero is none", delay_s=asked.delay_s)
        span = Span.of_seconds(asked.start_s, asked.until_s, asked.duration_s)
        self._messages = OrderedMessages(self._bag, self.channels, span, threaded=self.clock.kind == "system")
        self.playing = Playing(self._messages, self.clock, self._publish, rate=asked.rate, paused=asked.paused)

    async def run(self) -> None:
        """Play to the end, over and over if asked."""
        if self.playing is None:
            return
        if self.parameters.delay_s > 0:
            await self.clock.sleep(self.parameters.delay_s)
        while await self.playing.play() and self.parameters.loop and await self.playing.again():
            continue
        self.damage = self._bag.damage
        if self.parameters.clock_hz:
            self.publish_time()  # how late it is in the end
        if self._bag.incomplete:
            self.log.warning("the recording is not the whole of what happened", reason="; ".join(self._bag.incomplete))
        self.log.info("played to the end", messages=self.playing.played)

    async def stop(self) -> None:
        """Close the file."""
        if self.playing is not None:
            await self._messages.close()

    @property
    def incomplete(self) -> tuple[str, ...]:
        """The reasons why the recording is incomplete, as far as it has been played."""
        return self._bag.incomplete

    @on_parameters
    def on_change(self, _old: PlayerParameters) -> None:
        """Apply the new rate, or pause or resume."""
        if self.playing is None:
            return
        clock = self.playing.clock
        if self.parameters.rate != clock.rate:
            clock.set_rate(self.parameters.rate)
        if self.parameters.paused and not clock.is_paused:
            clock.pause()
        elif clock.is_paused and not self.parameters.paused:
            clock.resume()

    def step(self) -> None:
        """While paused, publish one message."""
        if self.playing is not None:
            self.spawn(self._step(self.playing), name="step")

    async def _step(self, playing: Playing) -> None:
        await playing.play_next()

    def publish_time(self) -> None:
        """Publish the moment that is being played, for runs whose time follows it."""
        if self.playing is not None:
            self._clock.publish(Clock(clock=Time(max(0, self.playing.position_ns)).to_msg()))

    @service(Trigger, "~/pause")
    def on_pause(self, _request: Trigger.Request) -> Trigger.Response:
        """Let time stand still."""
        return self._set_paused(True)

    @service(Trigger, "~/resume")
    def on_resume(self, _request: Trigger.Request) -> Trigger.Response:
        """Let time go on."""
        return self._set_paused(False)

    @service(Trigger, "~/toggle_paused")
    def on_toggle(self, _request: Trigger.Request) -> Trigger.Response:
        """Pause, or resume."""
        return self._set_paused(not self.parameters.paused)

    @service(Trigger, "~/play_next")
    async def on_play_next(self, _request: Trigger.Request) -> Trigger.Response:
        """While paused, publish one message."""
        done = self.playing is not None and await self.playing.play_next()
        return Trigger.Response(success=done, message="" if done else "it is not paused, or at the end")

    def _set_paused(self, paused: bool) -> Trigger.Response:
        runtime_of(self).parameters.set({"paused": paused})
        return Trigger.Response(success=True, message="paused" if paused else "playing")

    async def _publish(self, entry: Entry) -> None:
        publisher, decode = self._outputs[entry.channel]
        try:
            message = decode(entry.payload)
        except MalformedMessage as error:
            topic = entry.channel.topic
            self.refused[topic] = self.refused.get(topic, 0) + 1
            if self.refused[topic] == 1:
                self.log.warning("a message cannot be read and is left out", topic=topic, reason=str(error))
            return
        await publisher.send(message)
