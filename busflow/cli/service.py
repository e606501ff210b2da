"""`busflow service`: lists, describes and calls the services of a running graph."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.interfaces import takes_interfaces
from busflow.cli.options.launch_file import DURATION
from busflow.cli.options.lazy_group import LazyGroup
from busflow.cli.options.message import wants
from busflow.cli.options.run import complete_services, full_type, joined, joins
from busflow.cli.options.waiting import Waiting, WaitingCommand, wait_option
from busflow.cli.terminal.listing import print_list, print_of_type
from busflow.cli.terminal.output import print_answer, print_found
from busflow.cli.terminal.table import print_table
from busflow.errors import InvalidInput, NoSuchTarget, Problem, ServiceUnavailable
from busflow.text import printable
from busflow.wire.client.graph_view import LOGGER_SERVICES, TopicView

if TYPE_CHECKING:
    from busflow.cli.terminal.field_paths import Shape
    from busflow.cli.terminal.message_text import Wanted
    from busflow.wire.client.client import Peer

_VERBS = {
    "list": ("busflow.cli.service:list_", "List the services."),
    "type": ("busflow.cli.service:type_", "Show a service's type."),
    "find": ("busflow.cli.service:find", "List the services of a type."),
    "info": ("busflow.cli.service:info", "Show a service's servers and clients, and what became of the calls."),
    "call": ("busflow.cli.service:call", "Call a service."),
    "echo": ("busflow.cli.service:echo", "Print the requests and responses of a service."),
}
_EXAMPLES = """\b
Examples:
  busflow service list -t
  busflow service info sensor_publisher/reset
  busflow service call sensor_publisher/reset std_srvs/srv/Trigger
  busflow service call lamp/switch std_srvs/srv/SetBool '{data: true}' --timeout 2
  busflow service echo lamp/switch"""
_ANSWER = "5s"

service: LazyGroup = LazyGroup(
    "service", _VERBS, help="Look at the services of a running graph, and call them.", epilog=_EXAMPLES
)
_name = click.argument("name", shell_complete=complete_services)


@click.command("list", epilog=_EXAMPLES)
@click.option("-t", "--show-types", is_flag=True, help="Also show each service's type.")
@click.option("-c", "--count-services", "count", is_flag=True, help="Only show the number of services.")
@click.option("--include-hidden-services", "all_", is_flag=True, help="Also hidden services, and those of log levels.")
@joins
def list_(run: str | None, show_types: bool, count: bool, all_: bool, as_json: bool) -> None:
    """List the services of a running graph."""
    with joined(run) as peer:
        services = [each for each in peer.graph().services.values() if all_ or not _is_hidden(each)]
    if as_json:
        print_answer({"run": peer.run.name, "services": [_as_json(each) for each in services]})
    else:
        print_list(services, count=count, show_types=show_types)


@click.command("type", epilog=_EXAMPLES)
@_name
@joins
def type_(run: str | None, name: str, as_json: bool) -> None:
    """Show the type of the service NAME."""
    with joined(run) as peer:
        found = peer.graph().service(name)
    print_found({"name": found.name, "types": found.types}, found.types, as_json=as_json)


@click.command(epilog=_EXAMPLES)
@click.argument("type_name", metavar="TYPE")
@joins
def find(run: str | None, type_name: str, as_json: bool) -> None:
    """List the services whose type is TYPE, such as std_srvs/srv/Trigger."""
    full = full_type(type_name, "srv")
    with joined(run) as peer:
        services = peer.graph().services.values()
    print_of_type(full, services, "service", as_json=as_json)


@click.command(epilog=_EXAMPLES)
@_name
@joins
def info(run: str | None, name: str, as_json: bool) -> None:
    """Show the servers and clients of the service NAME, and what became of the calls."""
    with joined(run) as peer:
        found = peer.graph().service(name)
        answers = [answer[found.name] for answer in peer.ask("services", names=[found.name]) if found.name in answer]
    accounts = {word: [each for answer in answers for each in answer[word]] for word in ("servers", "clients")}
    if as_json:
        print_answer({"run": peer.run.name, **_as_json(found), "accounts": accounts})
        return
    click.echo(f"Type: {printable(found.type)}")
    click.echo(f"Clients count: {len(found.subscriptions)}")
    click.echo(f"Services count: {len(found.publishers)}")
    for word, rows in accounts.items():
        print_table([(word[:-1], each["node"], *_counts(each)) for each in rows], indent="  ")


@click.command(cls=WaitingCommand, epilog=_EXAMPLES)
@_name
@click.argument("type_name", metavar="TYPE")
@click.argument("values", default="")
@click.option(
    "--timeout",
    "timeout_s",
    type=DURATION,
    default=_ANSWER,
    show_default=True,
    help="Wait for the answer no longer than this.",
)
@wait_option
@takes_interfaces
@joins
def call(
    run: str | None,
    name: str,
    type_name: str,
    values: str,
    timeout_s: float,
    wait_s: float | None,
    as_json: bool,
) -> None:
    """Call the service NAME of type TYPE, and show its response.

    VALUES is the request as YAML; fields that it leaves out have their defaults.
    """
    from busflow.cli.terminal.abridged import Abridger
    from busflow.cli.terminal.field_paths import shape_of
    from busflow.cli.terminal.one_line import python_form
    from busflow.cli.topic.typed_values import TypedValues
    from busflow.wire.client.known_type import known_service

    waiting = Waiting(wait_s)
    with waiting.joined(run) as peer:
        kind = waiting.until(
            lambda: known_service(peer, _asked(peer, name, full_type(type_name, "srv"))),
            NoSuchTarget,
            ServiceUnavailable,
        )
        shape = shape_of(kind.request)
        abridge = Abridger(None) if as_json else Abridger()  # JSON is never cut
        request = TypedValues(values, kind.request, shape).at(0)
        if not as_json:
            shown = abridge(kind.request.decode(kind.request.encode(request)), shape)
            click.echo(f"requester: making request: {python_form(shown, shape)}\n")
        answer = peer.call(kind, request, timeout_s=timeout_s)
        answered: Shape | None = shape_of(kind.response)
        response = abridge(answer, answered)
    if as_json:
        print_answer({"service": kind.name, "type": kind.type, "response": response})
    else:
        click.echo(f"response:\n{python_form(response, answered)}\n")


@click.command(cls=WaitingCommand, epilog=_EXAMPLES)
@_name
@click.argument("type_name", metavar="[TYPE]", required=False)
@click.option("-n", "--count", type=click.IntRange(min=1), metavar="N", help="Stop after N requests and responses.")
@click.option("--timeout", "timeout_s", type=DURATION, help="Stop with exit code 1 when nothing came for this time.")
@wait_option
@wants
@takes_interfaces
@joins
def echo(
    run: str | None,
    name: str,
    type_name: str | None,
    count: int | None,
    timeout_s: float | None,
    wait_s: float | None,
    wanted: Wanted,
) -> int:
    """Print each request that the server of the service NAME gets, and each response that it gives, until Ctrl-C.

    They are those of ROS 2's service introspection, which needs no setting here. A call that fails has no response.
    """
    from busflow.cli.terminal.message_text import TextForm
    from busflow.cli.topic.echoing import Echo
    from busflow.wire.client.graph_view import TopicView

    form = TextForm.FLOW if wanted.form is TextForm.YAML else wanted.form
    waiting = Waiting(wait_s)
    with waiting.joined(run) as peer:
        service = waiting.until(lambda: peer.graph().service(name), NoSuchTarget)
        if type_name is not None:
            _require_type(service, full_type(type_name, "srv"))
        type_ = peer.service(service.name, events=True).event
        if type_ is None:
            raise NoSuchTarget(f"the calls of {printable(service.name)}, which every node answers, are not published")
        decode = type_.decode

        def with_words(payload: bytes) -> Any:
            event: dict[str, Any] = dict(decode(payload))
            info: dict[str, Any] = dict(event["info"])
            return {**event, "info": {**info, "event_type": _EVENTS.get(info["event_type"], info["event_type"])}}

        topic = TopicView(f"{service.name}/_service_event", (type_.name,), (), ())
        return Echo(peer, topic, type_, replace(wanted, form=form), decode=with_words).follow(count, timeout_s)


_EVENTS = {0: "REQUEST_SENT", 1: "REQUEST_RECEIVED", 2: "RESPONSE_SENT", 3: "RESPONSE_RECEIVED"}
"""ROS 2's words for the types of events, by their number."""


def _asked(peer: Peer, name: str, type_name: str) -> TopicView:
    """Return the service, or raise if it has another type or no server."""
    found = peer.graph().service(name)
    _require_type(found, type_name)
    if not found.publishers:
        raise ServiceUnavailable(f"{found.name} has clients only, no server")
    return found


def _require_type(service: TopicView, type_name: str) -> None:
    if type_name not in service.types:
        message = f"{service.name} has the type {service.type}, not {printable(type_name)}"
        raise InvalidInput(Problem("type", message, f"busflow interface show {service.types[0]} shows its fields"))


def _is_hidden(service: TopicView) -> bool:
    return service.hidden or not LOGGER_SERVICES.isdisjoint(service.types)


def _counts(account: dict[str, Any]) -> list[str]:
    return [f"{count} {word}" for word, count in account.items() if isinstance(count, int) and word != "depth"]


def _as_json(service: TopicView) -> dict[str, Any]:
    return {
        "name": service.name,
        "types": service.types,
        "servers": [end.node for end in service.publishers],
        "clients": [end.node for end in service.subscriptions],
    }
