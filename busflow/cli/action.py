"""`busflow action`: lists and describes the actions of a running graph, sends goals and cancels them."""

from __future__ import annotations

import uuid
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.interfaces import takes_interfaces
from busflow.cli.options.launch_file import DURATION
from busflow.cli.options.lazy_group import LazyGroup
from busflow.cli.options.message import wants
from busflow.cli.options.run import complete_actions, full_type, joined, joins
from busflow.cli.options.waiting import Waiting, WaitingCommand, wait_option
from busflow.cli.terminal.listing import print_list, print_of_type
from busflow.cli.terminal.output import local_time, print_answer, print_found, print_line
from busflow.cli.terminal.table import print_table, print_text
from busflow.errors import ExitCode, GoalRejected, InvalidInput, NoSuchTarget, Problem
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.cli.terminal.message_text import Wanted
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.wire.client.actions import ActionPeer, ActionView, PeerGoal
    from busflow.wire.client.client import Peer

_VERBS = {
    "list": ("busflow.cli.action:list_", "List the actions."),
    "info": ("busflow.cli.action:info", "Show an action's servers and clients, and what became of the goals."),
    "type": ("busflow.cli.action:type_", "Show an action's type."),
    "find": ("busflow.cli.action:find", "List the actions of a type."),
    "send_goal": ("busflow.cli.action:send_goal", "Send a goal, and wait for its result."),
    "goals": ("busflow.cli.action:goals", "List the goals of an action, with those that ended lately."),
    "cancel": ("busflow.cli.action:cancel", "Cancel a goal, or all goals of an action."),
    "echo": ("busflow.cli.action:echo", "Print the feedback of an action."),
}
_EXAMPLES = """\b
Examples:
  busflow action list -t
  busflow action info joint_mover/move
  busflow action send_goal -f joint_mover/move lab/action/MoveJoint '{angle: 1.0}'
  busflow action goals joint_mover/move
  busflow action cancel joint_mover/move --all"""
_ANSWER = "5s"
_STATES = ("UNKNOWN", "ACCEPTED", "EXECUTING", "CANCELING", "SUCCEEDED", "CANCELED", "ABORTED")
"""ROS 2's words for the states of goals, by their number."""
_SUCCEEDED = 4

action: LazyGroup = LazyGroup(
    "action", _VERBS, help="Look at the actions of a running graph, and send them goals.", epilog=_EXAMPLES
)
_name = click.argument("name", shell_complete=complete_actions)
_timeout = click.option(
    "--timeout", "timeout_s", type=DURATION, default=_ANSWER, show_default=True, help="Wait for the answer this long."
)


@click.command("list", epilog=_EXAMPLES)
@click.option("-t", "--show-types", is_flag=True, help="Also show each action's type.")
@click.option("-c", "--count-actions", "count", is_flag=True, help="Only show the number of actions.")
@joins
def list_(run: str | None, show_types: bool, count: bool, as_json: bool) -> None:
    """List the actions of a running graph."""
    from busflow.wire.client.actions import actions_of

    with joined(run) as peer:
        found = [*actions_of(peer.graph()).values()]
    if as_json:
        print_answer({"run": peer.run.name, "actions": [_as_json(each) for each in found]})
    else:
        print_list(found, count=count, show_types=show_types)


@click.command(epilog=_EXAMPLES)
@click.option("-t", "--show-types", is_flag=True, help="Also show the type at each node.")
@click.option("-c", "--count", is_flag=True, help="Only show the numbers of clients and servers.")
@_name
@joins
def info(run: str | None, name: str, show_types: bool, count: bool, as_json: bool) -> None:
    """Show the servers and clients of the action NAME, and what became of the goals."""
    from busflow.actions.accounts import action_accounts

    with joined(run) as peer:
        found = _named(peer, name)
        answers = [answer for graph in peer.ask("graph") for answer in action_accounts(graph["services"])]
    accounts = [each for each in answers if each["name"] == found.name]
    if as_json:
        print_answer({"run": peer.run.name, **_as_json(found), "accounts": accounts})
        return
    click.echo(f"Action: {printable(found.name)}")
    for word, nodes in (("clients", found.clients), ("servers", found.servers)):
        click.echo(f"Action {word}: {len(nodes)}")
        for node in () if count else nodes:
            print_text(f"    {node}", *([f"[{found.type}]"] if show_types else []), indent="      ")
    lines = [(word[:-1], each) for account in accounts for word in ("servers", "clients") for each in account[word]]
    if lines and not count:
        print_table([(word, each["node"], *_counts(each)) for word, each in lines], indent="  ")


@click.command("type", epilog=_EXAMPLES)
@_name
@joins
def type_(run: str | None, name: str, as_json: bool) -> None:
    """Show the type of the action NAME."""
    with joined(run) as peer:
        found = _named(peer, name)
    print_found({"name": found.name, "types": found.types}, found.types, as_json=as_json)


@click.command(epilog=_EXAMPLES)
@click.option("-c", "--count-actions", "count", is_flag=True, help="Only show the number of actions.")
@click.argument("type_name", metavar="TYPE")
@joins
def find(run: str | None, type_name: str, count: bool, as_json: bool) -> None:
    """List the actions whose type is TYPE, such as example_interfaces/action/Fibonacci."""
    from busflow.wire.client.actions import actions_of

    full = full_type(type_name, "action")
    with joined(run) as peer:
        actions = actions_of(peer.graph()).values()
    print_of_type(full, actions, "action", as_json=as_json, count=count, none="no node has an action")


@click.command("send_goal", cls=WaitingCommand, epilog=_EXAMPLES)
@_name
@click.argument("type_name", metavar="TYPE")
@click.argument("values", default="")
@click.option("-f", "--feedback", is_flag=True, help="Also print the feedback.")
@_timeout
@wait_option
@takes_interfaces
@joins
def send_goal(
    run: str | None,
    name: str,
    type_name: str,
    values: str,
    feedback: bool,
    timeout_s: float,
    wait_s: float | None,
    as_json: bool,
) -> int:
    """Send the action NAME of type TYPE a goal, and wait for its result; Ctrl-C cancels it.

    VALUES is the goal as YAML; fields that it leaves out have their defaults. --timeout is for the answer whether the
    goal is accepted. Exit code 1 if the goal does not succeed.
    """
    from busflow.cli.terminal.field_paths import shape_of
    from busflow.cli.topic.typed_values import TypedValues
    from busflow.wire.client.actions import ActionPeer

    waiting = Waiting(wait_s)
    with waiting.joined(run) as peer:
        if not as_json:
            click.echo("Waiting for an action server to become available...")
        client = waiting.until(
            lambda: ActionPeer(peer, _of_type(peer, name, full_type(type_name, "action"))), NoSuchTarget
        )
        goal = TypedValues(values, client.goal_type, shape_of(client.goal_type)).at(0)
        show = _Show(as_json=as_json)
        show.goal(client, goal)
        with (
            show.rejected(),
            client.sent(goal, timeout_s=timeout_s, on_feedback=show.feedback if feedback else None) as going,
        ):
            try:
                show.accepted(going)
                state, result = going.result()
            except KeyboardInterrupt:
                show.canceling()
                going.cancel(timeout_s=timeout_s)
                state, result = going.result()
                show.canceled(is_canceled=_state(state) == "CANCELED")
            show.result(client, going, state, result)
    return ExitCode.OK if state == _SUCCEEDED else ExitCode.FAILED


class _Show:
    """Prints the way of a goal in ROS 2's words, or as lines of JSON."""

    def __init__(self, *, as_json: bool) -> None:
        self._as_json = as_json

    def goal(self, client: ActionPeer, goal: Mapping[str, Any]) -> None:
        if not self._as_json:
            whole = client.goal_type.decode(client.goal_type.encode(goal))
            click.echo(f"Sending goal:\n{_yaml(whole, client.goal_type, indent='     ')}")

    @contextmanager
    def rejected(self) -> Generator[None]:
        try:
            yield
        except GoalRejected:
            if not self._as_json:
                click.echo("Goal was rejected.")
            raise

    def accepted(self, going: PeerGoal) -> None:
        if self._as_json:
            print_line({"accepted": str(going.id)})
        else:
            click.echo(f"Goal accepted with ID: {going.id.hex}\n")

    def feedback(self, feedback: Any) -> None:
        if self._as_json:
            print_line({"feedback": _plain(feedback)})
        else:
            click.echo(f"Feedback:\n{_yaml(feedback)}")

    def canceling(self) -> None:
        if not self._as_json:
            click.echo("Canceling goal...")

    def canceled(self, *, is_canceled: bool) -> None:
        if not self._as_json:
            click.echo("Goal canceled." if is_canceled else "Failed to cancel goal")

    def result(self, client: ActionPeer, going: PeerGoal, state: int, result: Any) -> None:
        if self._as_json:
            remark = {"reason": going.remark} if going.remark else {}
            print_line({"status": _state(state), "result": _plain(result), **remark})
            return
        click.echo(f"Result:\n{_yaml(result, client.result_type)}")
        why = f": {going.remark}" if going.remark else ""
        click.echo(f"Goal finished with status: {_state(state)}{why}")


@click.command(epilog=_EXAMPLES)
@_name
@takes_interfaces
@joins
def goals(run: str | None, name: str, as_json: bool) -> None:
    """List the goals of the action NAME with their states; those that ended lately too."""
    from busflow.cli.terminal.table import Column
    from busflow.wire.client.actions import ActionPeer

    with joined(run) as peer:
        found = _named(peer, name)
        rows = ActionPeer(peer, found).goals()
    for each in rows:
        each["state"] = _state(each["state"])
    if as_json:
        print_answer({"action": found.name, "goals": rows})
    elif rows:
        shown = [(each["id"], each["state"], local_time(each["accepted_ns"])) for each in rows]
        print_table(shown, Column("goal"), Column("state"), Column("accepted"))
    else:
        click.echo(f"{printable(found.name)} has no goals, and had none lately")


@click.command(epilog=_EXAMPLES)
@_name
@click.argument("goal", metavar="[ID]", required=False)
@click.option("--all", "all_", is_flag=True, help="Cancel all goals of the action.")
@_timeout
@takes_interfaces
@joins
def cancel(run: str | None, name: str, goal: str | None, all_: bool, timeout_s: float, as_json: bool) -> None:
    """Cancel the goal ID of the action NAME, or all of its goals. `goals NAME` shows the identifiers."""
    from busflow.wire.client.actions import ActionPeer

    if (goal is None) != all_:
        raise click.UsageError("give the identifier of one goal, or --all")
    goal_id = None if goal is None else _identifier(goal)
    with joined(run) as peer:
        found = _named(peer, name)
        canceled = ActionPeer(peer, found).cancel(goal_id, timeout_s=timeout_s)
    print_found({"action": found.name, "canceling": canceled}, canceled, as_json=as_json)


@click.command(cls=WaitingCommand, epilog=_EXAMPLES)
@_name
@click.option("-n", "--count", type=click.IntRange(min=1), metavar="N", help="Stop after N messages.")
@click.option("--timeout", "timeout_s", type=DURATION, help="Stop with exit code 1 when nothing came for this time.")
@wait_option
@wants
@takes_interfaces
@joins
def echo(
    run: str | None, name: str, count: int | None, timeout_s: float | None, wait_s: float | None, wanted: Wanted
) -> int:
    """Print the feedback of all goals of the action NAME, until Ctrl-C."""
    from busflow.cli.topic.echoing import Echo
    from busflow.wire.client.actions import ActionPeer
    from busflow.wire.client.known_type import known_type

    waiting = Waiting(wait_s)
    with waiting.joined(run) as peer:
        topic = ActionPeer(peer, waiting.until(lambda: _named(peer, name), NoSuchTarget)).feedback_topic
        return Echo(peer, topic, known_type(peer, topic.types[0]), wanted).follow(count, timeout_s)


def _named(peer: Peer, name: str) -> ActionView:
    from busflow.wire.client.actions import action_named

    return action_named(peer.graph(), name)


def _of_type(peer: Peer, name: str, type_name: str) -> ActionView:
    """Return the action, or raise if it has another type."""
    found = _named(peer, name)
    if type_name not in found.types:
        message = f"{found.name} has the type {found.type}, not {printable(type_name)}"
        raise InvalidInput(Problem("type", message, f"write {found.type}"))
    return found


def _identifier(text: str) -> uuid.UUID:
    try:
        return uuid.UUID(text)
    except ValueError:
        message = f"{printable(repr(text), limit=100)} is not the identifier of a goal"
        raise InvalidInput(Problem("goal", message, "busflow action goals NAME lists them")) from None


def _state(state: int) -> str:
    return _STATES[state] if 0 <= state < len(_STATES) else f"UNKNOWN ({state})"


def _plain(value: Any) -> Any:
    """Return a message as plain values, whole, for JSON."""
    from busflow.cli.terminal.abridged import Abridger

    return Abridger(None)(value)


def _yaml(value: Any, type_: ForeignType | None = None, *, indent: str = "    ") -> str:
    """Return a message as indented YAML, as ROS 2's command prints it, with an empty line behind."""
    from busflow.cli.terminal.abridged import Abridger
    from busflow.cli.terminal.field_paths import shape_of
    from busflow.cli.terminal.yaml_text import yaml_lines

    shown = Abridger()(value, None if type_ is None else shape_of(type_))
    return "".join(f"{indent}{line}\n" for line in yaml_lines(shown))


def _counts(account: Mapping[str, Any]) -> list[str]:
    return [f"{count} {word}" for word, count in account.items() if isinstance(count, int)]


def _as_json(action: ActionView) -> dict[str, Any]:
    return {"name": action.name, "types": action.types, "servers": action.servers, "clients": action.clients}
