"""Publishing: publishes typed values at a rate, or those of a stream, once there are enough subscriptions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from itertools import repeat
from math import inf
from typing import TYPE_CHECKING, BinaryIO

import click

from busflow.bus.names import absolute_name, check_full_topic_name
from busflow.cli.options.run import full_type, until_run_ends
from busflow.cli.terminal.abridged import Abridger
from busflow.cli.terminal.field_paths import shape_of
from busflow.cli.terminal.one_line import python_form
from busflow.cli.terminal.output import print_line, print_message
from busflow.cli.topic.message_lines import MessageLines
from busflow.cli.topic.typed_values import TypedValues
from busflow.clock import NS_PER_S, SystemClock, sleep
from busflow.errors import ExitCode, InvalidInput, Problem
from busflow.text import counted, did_you_mean, printable
from busflow.wire.client.known_type import known_type
from busflow.wire.client.offer import Offer, misfits
from busflow.wire.zenoh.keys import Token, TokenKind

if TYPE_CHECKING:
    from busflow.wire.client.client import Peer, Speaker
    from busflow.wire.client.graph_view import GraphView

_LOOK_S = 1.0
"""The interval at which to print that subscriptions are missing, and to check that the run is alive."""


class Publishing:
    """The publishing of typed values on a topic of a run."""

    def __init__(
        self,
        peer: Peer,
        name: str,
        type_name: str,
        values: str | BinaryIO,
        offer: Offer,
        *,
        print_every: int,
        as_json: bool,
    ) -> None:
        """Check everything before anything is published; `values` are of every message, or a stream with a line each.

        Raises:
            InvalidName: The topic's name is not valid.
            InvalidInput: The topic has another type, or the values do not fit.
            UnknownType: Neither busflow nor the run knows the type.
            LaunchError: The values are not YAML.
        """
        self._peer, self._print_every, self._as_json = peer, print_every, as_json
        self._topic = absolute_name(name)
        check_full_topic_name(self._topic)
        graph = peer.graph()
        self._type = known_type(peer, full_type(type_name))
        self._shape = shape_of(self._type)
        there = graph.topics.get(self._topic)
        if there is not None and self._type.name not in there.types:
            message = f"{self._topic} has the type {there.type}, not {self._type.name}"
            raise InvalidInput(Problem("type", message, f"busflow interface show {there.types[0]} shows its fields"))
        self._values: Iterable[TypedValues] = (
            repeat(TypedValues(values, self._type, self._shape))
            if isinstance(values, str)
            else MessageLines(values, self._type, self._shape)
        )
        asked = [each.token for each in there.subscriptions] if there is not None else []
        self._offer, self._qos = offer, offer.text(asked)
        self._warned = set[str]()
        self._warn_misfits(asked)
        if there is None or not there.subscriptions:
            self._warn_unreceived(graph)
        self._is_stream = not isinstance(values, str)
        self._clock = SystemClock()
        self._looked_ns = 0

    def go(self, rate: float | None, times: int | None, matches: int, patience_s: float | None = None) -> ExitCode:
        """Publish at most `times` messages; return FAILED if there were not `matches` subscriptions in time.

        Without a rate, each message of a stream is published as it comes.

        Raises:
            RunEnded: The run has ended before all was published.
            InvalidInput: A line of the stream is no message.
        """
        with until_run_ends(wants_more=times is not None or self._is_stream), ExitStack() as ends:
            speaker = self._matched(ends, matches, inf if patience_s is None else patience_s)
            if speaker is None:
                wanted = counted(matches, "subscription")
                print_message(f"error: {printable(self._topic)} did not have {wanted} within {patience_s:g} s")
                return ExitCode.FAILED
            if not self._as_json:
                click.echo("publisher: beginning loop")
            self._looked_ns = due_ns = self._clock.monotonic_ns()
            for each in self._values:
                self._publish(speaker, each)
                if times is not None and speaker.published >= times:
                    return ExitCode.OK
                if rate is not None:
                    late_ns = max(0, self._clock.monotonic_ns() - due_ns) if self._is_stream else 0
                    due_ns += late_ns + round(NS_PER_S / rate)  # a stream that was silent does not catch up
                self._pause_until(due_ns)
        return ExitCode.OK

    def _pause_until(self, due_ns: int) -> None:
        """Wait, and check once a second that the run is alive."""
        while True:
            now_ns = self._clock.monotonic_ns()
            if now_ns - self._looked_ns > _LOOK_S * NS_PER_S:
                self._looked_ns = now_ns
                self._peer.require_run()
                self._warn_misfits(self._subscriptions())
            if now_ns >= due_ns:
                return
            sleep(min((due_ns - now_ns) / NS_PER_S, _LOOK_S))

    def _publish(self, speaker: Speaker, typed: TypedValues) -> None:
        values = typed.at(self._clock.now().nanoseconds)
        speaker.publish(values)
        if speaker.published % self._print_every:
            return
        sent = self._type.decode(self._type.encode(values))
        if self._as_json:
            print_line({"topic": self._topic, "count": speaker.published, "message": Abridger(None)(sent, self._shape)})
        else:
            shown = Abridger()(sent, self._shape)
            click.echo(f"publishing #{speaker.published}: {python_form(shown, self._shape)}\n")

    def _matched(self, ends: ExitStack, matches: int, patience_s: float) -> Speaker | None:
        """Wait for this many subscriptions, printing a line each second; return None if there were not in time."""
        speaker = self._advertised(ends)
        began_ns, announced = self._clock.monotonic_ns(), False
        while matches:
            left_s = patience_s - (self._clock.monotonic_ns() - began_ns) / NS_PER_S
            there = self._subscriptions()
            enough = sum(each.has_type(self._type.name, self._type.type_hash) for each in there) >= matches
            if enough and (qos := self._offer.text(there)) != self._qos:  # those that have come ask for more
                ends.close()
                self._qos = qos
                speaker = self._advertised(ends)
            if enough and speaker.wait_for_listener(max(0.0, min(_LOOK_S, left_s))):
                if announced:
                    self._peer.settle()  # new subscriptions may not have discovered this publisher yet
                break
            if left_s <= 0:
                return None
            if not announced:
                announced = True
                print_message("to publish at once, without waiting for subscriptions: -w 0")
            print_message(f"Waiting for at least {matches} matching subscription(s)...", error_stream=self._as_json)
            self._peer.require_run()
            if not enough:
                sleep(min(_LOOK_S, left_s))
        return speaker

    def _advertised(self, ends: ExitStack) -> Speaker:
        return ends.enter_context(self._peer.advertise(self._topic, self._type, qos=self._qos))

    def _subscriptions(self) -> list[Token]:
        wanted = TokenKind.SUBSCRIPTION, self._topic
        return [each for each in self._peer.tokens() if (each.kind, each.topic) == wanted]

    def _warn_misfits(self, subscriptions: Sequence[Token]) -> None:
        """Name each subscription that does not receive this, and why, once."""
        for node, why in misfits(self._type, self._qos, subscriptions).items():
            if node not in self._warned:
                self._warned.add(node)
                print_message(f"warning: {printable(node)} does not receive {printable(self._topic)}: {printable(why)}")

    def _warn_unreceived(self, graph: GraphView) -> None:
        received = [each.name for each in graph.topics.values() if each.subscriptions and not each.hidden]
        advice = did_you_mean(self._topic, received, none="no topic is received so far")
        print_message(f"warning: {printable(self._topic)} has no subscription; {advice}")
