"""The data sheet of one plugin: its parameters, its topics, and the services it answers and asks."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow.bus import names
from busflow.cli.terminal.table import Column, print_table, print_text
from busflow.clock import SystemClock
from busflow.errors import InvalidParameter, LaunchError
from busflow.interfaces.message import Message, ServiceType, type_name
from busflow.launchfile.check.preflight import Preflight
from busflow.log import Log
from busflow.node.declarations import ClientDeclaration, PublisherDeclaration, PullDeclaration
from busflow.node.handlers import Handler, ServiceRole, SubscriptionRole, declarations_of
from busflow.node.node import default_name, parameters_class
from busflow.node.parameters import ParameterInfo, describe
from busflow.node.plugins import load
from busflow.node.supervision import Supervision
from busflow.validation.tracebacks import shown

if TYPE_CHECKING:
    from busflow.node.node import Node

Names = tuple[tuple[str, str], ...]
"""Topics or services, each with its type."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """What a user of a plugin wants to know before writing it into a launch file."""

    name: str
    summary: str
    file: str
    parameters: tuple[ParameterInfo, ...]
    publishes: Names
    receives: Names
    serves: Names
    calls: Names
    complete: bool
    """False where a parameter without a default may still decide about topics."""

    def as_json(self) -> dict[str, Any]:
        """The sheet as `--json` prints it."""
        return {
            "name": self.name,
            "summary": self.summary,
            "file": self.file,
            "parameters": [_parameter_json(each) for each in self.parameters],
            "publishes": [{"topic": topic, "type": type_} for topic, type_ in self.publishes],
            "receives": [{"topic": topic, "type": type_} for topic, type_ in self.receives],
            "serves": [{"service": service, "type": type_} for service, type_ in self.serves],
            "calls": [{"service": service, "type": type_} for service, type_ in self.calls],
            "complete": self.complete,
        }

    def print(self) -> None:
        """Print the sheet for a person."""
        print_text(f"{self.name}: {self.summary}", indent="  ")
        print_text(f"  {self.file}")
        tables = {
            "Parameters": [_row(each) for each in self.parameters],
            "Publishes": self.publishes,
            "Receives": self.receives,
            **{title: rows for title, rows in (("Serves", self.serves), ("Calls", self.calls)) if rows},
        }
        for title, rows in tables.items():
            click.echo(f"\n{title}:" if rows else f"\n{title}: nothing")
            last = (Column(),) * (len(rows[0]) - 1) if rows else ()
            print_table(rows, *last, Column(folds=True), indent="  ")
        if not self.complete:
            click.echo()
            print_text("A parameter without a default may decide about more topics and services.")


def sheet(reference: str, folders: Sequence[Path]) -> Sheet:
    """Load a plugin and describe it.

    Raises:
        PluginError: It cannot be found or loaded.
        LaunchError: It cannot declare its endpoints.
    """
    node_class = load(reference, folders)
    try:
        ends, complete = _ends(node_class()), True
    except InvalidParameter:
        ends, complete = _declared_ends(node_class), False
    return Sheet(
        name=reference,
        summary=(inspect.getdoc(node_class) or "").partition("\n")[0],
        file=shown(inspect.getfile(node_class)),
        parameters=describe(parameters_class(node_class)),
        complete=complete,
        **ends,
    )


def _ends(node: Node) -> dict[str, Names]:
    """What a node with the default parameters publishes, receives, serves and calls."""
    clock = SystemClock()
    plan = Preflight(clock, Log(clock)).plan(nodes=[(node, Supervision())])
    if plan.errors:
        raise LaunchError(plan.errors)
    (member,) = plan.members
    return {
        "publishes": tuple((each.topic, type_name(each.type)) for each in member.publishers),
        "receives": tuple((each.topic, type_name(each.type)) for each in member.subscriptions),
        "serves": tuple((each.service, type_name(each.type)) for each in member.servers),
        "calls": tuple((each.service, type_name(each.type)) for each in member.clients),
    }


def _declared_ends(node_class: type[Node]) -> dict[str, Names]:
    """What the class itself says, where no instance can be made without the user's parameters."""
    found: dict[str, list[tuple[str, str]]] = {"publishes": [], "receives": [], "serves": [], "calls": []}
    for verb, name, kind in _declared(node_class):
        full = names.expand(name, node=default_name(node_class), namespace="/")
        found[verb].append((full, type_name(kind)))
    return {verb: tuple(each) for verb, each in found.items()}


def _declared(node_class: type[Node]) -> Iterator[tuple[str, str, type[Message | ServiceType]]]:
    for declared in declarations_of(node_class).values():
        if isinstance(declared, PublisherDeclaration):
            yield "publishes", declared.topic, declared.type
        elif isinstance(declared, PullDeclaration):
            yield "receives", declared.topic, declared.type
        elif isinstance(declared, ClientDeclaration):
            yield "calls", declared.service, declared.type
        elif isinstance(declared, Handler):
            for role in declared.roles:
                if isinstance(role, SubscriptionRole):
                    yield "receives", role.topic, declared.message_type()
                elif isinstance(role, ServiceRole):
                    yield "serves", role.service, role.type


def _parameter_json(parameter: ParameterInfo) -> dict[str, Any]:
    row = asdict(parameter)
    del row["bounds"]
    return row | parameter.bounds._asdict()


def _row(parameter: ParameterInfo) -> tuple[object, ...]:
    allowed = " | ".join(map(str, parameter.choices)) if parameter.choices else str(parameter.bounds)
    return (
        parameter.name,
        parameter.type,
        "required" if parameter.required else f"= {parameter.default}",
        allowed,
        parameter.description + (" (read-only)" if parameter.read_only else ""),
    )
