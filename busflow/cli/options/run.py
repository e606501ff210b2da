"""Options of every command that inspects a running graph: `--run`, `--json`, and the completion of names.

Zenoh is imported when a run is joined, so that `--help` costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any

import click

import busflow
from busflow import timeouts
from busflow.actions.names import SEND_GOAL
from busflow.cli.options.completers import Completer, completer
from busflow.cli.terminal.output import print_message
from busflow.errors import InvalidInput, Problem, RunEnded
from busflow.text import printable
from busflow.validation.versions import work_together

if TYPE_CHECKING:
    from busflow.wire.client.client import Peer
    from busflow.wire.client.graph_view import GraphView


def joins(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add `--run` and `--json` to a command, which receives them as `run` and `as_json`."""
    command = click.option("--json", "as_json", is_flag=True, help="Print JSON.")(command)
    return click.option(
        "--run",
        metavar="NAME",
        shell_complete=complete_runs,
        help="The run to inspect, if there are several; see busflow ps.",
    )(command)


@contextmanager
def joined(run: str | None) -> Generator[Peer]:
    """Join a run while the block lasts; without a name, the only one. One of another version is joined with a warning.

    Raises:
        NoSuchRun: There is none, or there are several and no name was given.
        InspectionUnavailable: It does not answer, or Zenoh is missing.
    """
    from busflow.wire.zenoh.session import require_zenoh

    require_zenoh()
    from busflow.wire.client.client import join

    with join(run) as peer:
        peer.on_silence = lambda text: print_message(f"warning: {text}; what is shown lacks its part")
        theirs, own = peer.run.card.version, busflow.__version__
        if not work_together(theirs, own):
            other = f"{printable(peer.run.name)} runs busflow {printable(theirs) or 'of an unknown version'}"
            print_message(f"warning: {other}, and this is {own}; what is shown may be wrong")
        yield peer


@contextmanager
def until_run_ends(*, wants_more: bool = False) -> Generator[None]:
    """Say that the run has ended, which ends the block without an error unless it `wants_more`."""
    try:
        yield
    except RunEnded as end:
        if wants_more:
            raise
        print_message(str(end))


def full_type(name: str, kind: str = "msg") -> str:
    """Return a type's full name, of which the middle part may be left out.

    >>> full_type("std_msgs/String"), full_type("std_srvs/Trigger", "srv"), full_type("std_msgs/msg/String")
    ('std_msgs/msg/String', 'std_srvs/srv/Trigger', 'std_msgs/msg/String')

    Raises:
        InvalidInput: It begins as values do, so the type was forgotten.
    """
    if name.startswith("{"):
        noun = {"msg": "topic", "srv": "service"}.get(kind, kind)
        fix = f"write the type before it; busflow {noun} type NAME shows the type"
        raise InvalidInput(Problem("type", f"{printable(name, limit=100)} stands where the type belongs", fix))
    return name.replace("/", f"/{kind}/") if name.count("/") == 1 else name


# Completion of names in a running graph.


def joined_to_complete(context: click.Context) -> AbstractContextManager[Peer]:
    """Join the run of `--run`, or the only one, if it answers at once."""
    from busflow.wire.client.client import join

    return join(context.params.get("run"), patience_s=timeouts.current.completion)


@completer
def complete_runs(_context: click.Context, _incomplete: str) -> Iterator[tuple[str, None]]:
    """Yield the names of the runs on this machine."""
    from busflow.wire.zenoh.run_directory import runs

    yield from ((each.name, None) for each in runs())


def _completer(names: Callable[[GraphView], Iterable[str]]) -> Completer:
    """Return a completer for names of a running graph; their leading slash may be left out."""

    @completer
    def complete(context: click.Context, incomplete: str) -> Iterator[tuple[str, None]]:
        from busflow.wire.client.graph_view import view

        with joined_to_complete(context) as peer:
            found = sorted(set(names(view(peer.tokens(), []))))
        yield from ((name if incomplete.startswith("/") else name.removeprefix("/"), None) for name in found)

    return complete


complete_topics: Completer = _completer(
    lambda graph: [topic.name for topic in graph.topics.values() if not topic.hidden]
)
complete_nodes: Completer = _completer(lambda graph: [node.name for node in graph.nodes.values() if not node.hidden])
complete_services: Completer = _completer(lambda graph: graph.services)
complete_actions: Completer = _completer(
    lambda graph: [name.removesuffix(SEND_GOAL) for name in graph.services if name.endswith(SEND_GOAL)]
)
complete_types: Completer = _completer(
    lambda graph: [type_ for topic in graph.topics.values() for type_ in topic.types]
)
