"""Echo: prints the messages of one topic of a run, with warnings about silence and losses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING, Any

import click

from busflow.bus.names import absolute_name, check_full_topic_name
from busflow.cli.options.run import full_type, until_run_ends
from busflow.cli.terminal.field_paths import Absent
from busflow.cli.terminal.output import print_message, require_reader
from busflow.clock import SystemClock
from busflow.errors import ExitCode, InvalidInput, MalformedMessage, NoSuchTarget, Problem
from busflow.text import counted, did_you_mean, printable
from busflow.wire.client.graph_view import GraphView, TopicView
from busflow.wire.client.known_type import known_type

if TYPE_CHECKING:
    from busflow.cli.terminal.message_text import Wanted
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.wire.client.client import Listener, Peer, Received

_CHECK_S = 1.0
"""The interval at which to check that the run is alive, while no message arrives."""


class Echo:
    """Prints the messages of one topic of a run."""

    def __init__(
        self,
        peer: Peer,
        topic: TopicView,
        type_: ForeignType,
        wanted: Wanted,
        *,
        with_info: bool = False,
        decode: Callable[[bytes], Any] | None = None,
    ) -> None:
        """Prepare to print a topic's messages.

        Args:
            peer: The client of the run.
            topic: The topic, which need not be in the run yet.
            type_: The type of its messages.
            wanted: What is printed of a message.
            with_info: Whether each message's times and number are printed before it.
            decode: Makes a message of its bytes, in place of the type's own function.

        Raises:
            InvalidInput: The type has no such field.
        """
        self._peer, self._topic, self._type = peer, topic, type_
        self._print = wanted.printer(topic.name, type_)
        if decode is not None:
            self._print = replace(self._print, decode=decode)
        self._warned: set[str] = set()
        self._with_info = with_info
        self._demand_field = False
        self._clock = SystemClock()

    def show_last(self, count: int) -> None:
        """Print the last messages that the run keeps, and a note if there are fewer than `count`."""
        name = self._topic.name
        for answer, messages in self._peer.ask_for_messages("history", topic=name, count=count):
            for received in messages:
                self._show(received)
            if len(messages) < min(count, answer["published"]):
                advice = f"to keep more, write in the launch file: topics: {{{name}: {{history: {count}}}}}"
                are = "is" if len(messages) == 1 else "are"
                print_message(f"{len(messages)} of the last {count} messages of {name} {are} kept; {advice}")
            elif len(messages) < count:
                print_message(f"{counted(len(messages), 'message was', 'messages were')} published on {name} so far")

    def follow(self, count: int | None, timeout_s: float | None, *, demand_field: bool = False) -> ExitCode:
        """Print messages as they arrive; return `FAILED` if none was printed within the timeout.

        Args:
            count: The most messages to print; None for all.
            timeout_s: The most seconds between two printed messages, and before the first; None for no limit.
            demand_field: Raise an error for a message without the wanted field, instead of leaving the message out.

        Raises:
            RunEnded: The run has ended before `count` messages.
            NoSuchTarget: A message lacks the demanded field.
        """
        self._demand_field = demand_field
        shown, printed_at = 0, self._clock.monotonic_ns()
        with until_run_ends(wants_more=count is not None), self._peer.listen(self._topic, self._type) as listener:
            while count is None or shown < count:
                received = listener.get(0) or self._wait(listener, printed_at, timeout_s)
                if received is not None and self._show(received):
                    shown, printed_at = shown + 1, self._clock.monotonic_ns()
                elif self._remaining_s(printed_at, timeout_s) <= 0:
                    print_message(f"error: nothing to print came on {self._topic.name} for {timeout_s:g} s")
                    return ExitCode.FAILED
        return ExitCode.OK

    def _wait(self, listener: Listener, printed_at: int, timeout_s: float | None) -> Received | None:
        """Wait for the next message, and return None after the timeout; an ended run raises."""
        self._warn_of_losses(listener)
        received = None
        while received is None and (left_s := self._remaining_s(printed_at, timeout_s)) > 0:
            received = listener.get(min(_CHECK_S, left_s))
            if received is None:
                self._peer.require_run()
                require_reader()
        return received

    def _remaining_s(self, printed_at: int, timeout_s: float | None) -> float:
        """Return the seconds until the timeout."""
        if timeout_s is None:
            return inf
        return timeout_s - (self._clock.monotonic_ns() - printed_at) / 1e9

    def _show(self, received: Received) -> bool:
        """Print a message; return False if it is left out."""
        try:
            text = self._print(received)
        except MalformedMessage as error:
            self._warn_once(f"warning: what came on {self._topic.name} cannot be read: {error}")
            return False
        except Absent as error:
            why = f"a message of {self._topic.name} has no such field: {error}"
            if self._demand_field:
                raise NoSuchTarget(f"{why}; -n 1 waits for one that has it") from None
            self._warn_once(f"warning: {why}")
            return False
        if text is None:
            return False
        if self._with_info:
            click.echo(_info(received, self._clock.now().nanoseconds))
        click.echo(text)
        return True

    def _warn_of_losses(self, listener: Listener) -> None:
        if listener.dropped or listener.lost:
            print_message(
                f"warning: {listener.dropped + listener.lost} messages of {self._topic.name} were not printed:"
                " they came faster than they could be read"
            )
            listener.dropped = listener.lost = 0

    def _warn_once(self, text: str) -> None:
        if text not in self._warned and len(self._warned) < 100:
            self._warned.add(text)
            print_message(text)


def found_topic(peer: Peer, name: str, type_name: str | None) -> tuple[GraphView, TopicView, ForeignType]:
    """Return the run's graph, the topic of a name, and its type; with a type, the topic need not be there yet.

    Raises:
        InvalidName: The topic's name is not valid.
        NoSuchTarget: There is no such topic, and no type was given; the error names the nearest.
        UnknownType: Neither busflow nor the run knows the type.
        InvalidInput: The topic has another type, or its publishers disagree about the type.
    """
    graph, full = peer.graph(), check_full_topic_name(absolute_name(name))
    if type_name is None or full in graph.topics:
        topic = graph.topic(name)
        return graph, topic, known_type(peer, agreed_type(topic, type_name))
    found = known_type(peer, full_type(type_name))
    return graph, TopicView(full, (found.name,), (), ()), found


def _info(received: Received, read_ns: int) -> str:
    """Return the times and number of a message in ROS 2's words; null stands for unknown."""
    info = {
        "publication_sequence_number": received.sequence or None,
        "received_timestamp": read_ns,
        "reception_sequence_number": None,
        "source_timestamp": received.stamp_ns or None,
    }
    return "\n".join([*(f"{word}: {'null' if value is None else value}" for word, value in info.items()), "---"])


def agreed_type(topic: TopicView, wanted: str | None) -> str:
    """Return the type on which a topic's endpoints agree, or the wanted one if an endpoint has it.

    Raises:
        InvalidInput: The endpoints disagree, or none has the wanted type.
    """
    full = full_type(wanted) if wanted else wanted
    if full in topic.types:
        return full
    if full is not None:
        message = f"{topic.name} has the type {topic.type}, not {printable(full)}"
        raise InvalidInput(Problem("type", message, "leave the type out"))
    first, *others = topic.types
    if others:
        message = f"{topic.name} has conflicting types: {topic.type}"
        fix = f"say which, such as {first}; busflow topic info -v shows whose they are"
        raise InvalidInput(Problem("type", message, fix))
    return first


def warn_if_unpublished(graph: GraphView, topic: TopicView) -> None:
    """Warn at once about a topic without a publisher, and name the nearest published one."""
    if topic.publishers:
        return
    published = [each.name for each in graph.topics.values() if each.publishers and not each.hidden]
    advice = did_you_mean(topic.name, published, none="no topic is published so far")
    print_message(f"warning: {printable(topic.name)} has no publisher; {advice}; waiting")
