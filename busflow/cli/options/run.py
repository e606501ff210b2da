"""What every command that looks into a running graph shares: `--run`, `--json` and its version, names to complete.

Zenoh is imported when a run is joined, so that `--help` costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

if TYPE_CHECKING:
    from busflow.wire.client.client import Peer
    from busflow.wire.client.graph_view import GraphView

_COMPLETION_S = 0.5
"""How long a completion may take: who presses the tab key is not to wait for a run that hangs."""

Completer = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def joins(command: Callable[..., Any]) -> Callable[..., Any]:
    """Adds `--run` and `--json` to a command, which gets them as `run` and `as_json`."""
    command = click.option("--json", "as_json", is_flag=True, help="Print JSON.")(command)
    return click.option(
        "--run",
        metavar="NAME",
        shell_complete=complete_runs,
        help="The run to look into, where there are several; see busflow ps.",
    )(command)


def joined(run: str | None) -> AbstractContextManager[Peer]:
    """Be a member of a run while the block lasts; without a name, of the only one there is.

    Raises:
        NoSuchRun: There is none, or it has to be said which.
        InspectionUnavailable: It does not answer, or Zenoh is missing.
    """
    from busflow.wire.zenoh.session import require_zenoh

    require_zenoh()
    from busflow.wire.client.client import join

    return join(run)


def full_type(name: str, kind: str = "msg") -> str:
    """A type's full name, of which the middle may be left out.

    >>> full_type("std_msgs/String"), full_type("std_srvs/Trigger", "srv"), full_type("std_msgs/msg/String")
    ('std_msgs/msg/String', 'std_srvs/srv/Trigger', 'std_msgs/msg/String')
    """
    return name.replace("/", f"/{kind}/") if name.count("/") == 1 else name


# Completion. The shell shows whatever a completer prints, so that it fails in silence.


def completer(names: Callable[[click.Context, str], Iterable[tuple[str, str | None]]]) -> Completer:
    """Completes what is typed to one of the names, each of which has a line of help or None."""

    def complete(context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
        try:
            found = list(names(context, incomplete))
        except Exception:  # noqa: BLE001  # the shell would show the error in the middle of what is being typed
            return []
        return [CompletionItem(name, help=line) for name, line in found if name.startswith(incomplete)]

    return complete


def joined_to_complete(context: click.Context) -> AbstractContextManager[Peer]:
    """Be a member of the run that `--run`, or its being the only one, says, if it answers at once."""
    from busflow.wire.client.client import join

    return join(context.params.get("run"), patience_s=_COMPLETION_S)


@completer
def complete_runs(_context: click.Context, _incomplete: str) -> Iterator[tuple[str, None]]:
    """The runs of this machine."""
    from busflow.wire.zenoh.run_directory import runs

    yield from ((each.name, None) for each in runs())


def _completer(names: Callable[[GraphView], Iterable[str]]) -> Completer:
    """Completes names of a running graph; their first slash may be left out."""

    @completer
    def complete(context: click.Context, incomplete: str) -> Iterator[tuple[str, None]]:
        from busflow.wire.client.graph_view import view

        with joined_to_complete(context) as peer:
            found = sorted(set(names(view(peer.tokens(), []))))
        yield from ((name if incomplete.startswith("/") else name.removeprefix("/"), None) for name in found)

    return complete


complete_topics = _completer(lambda graph: [topic.name for topic in graph.topics.values() if not topic.hidden])
complete_nodes = _completer(lambda graph: [node.name for node in graph.nodes.values() if not node.hidden])
complete_services = _completer(lambda graph: graph.services)
complete_types = _completer(lambda graph: [type_ for topic in graph.topics.values() for type_ in topic.types])
