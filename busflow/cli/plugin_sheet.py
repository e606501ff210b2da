"""The data sheet of one plugin: its parameters, and what it publishes and receives."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow import names
from busflow.blame import shown
from busflow.cli.output import print_columns
from busflow.clock import SystemClock
from busflow.declarations import PublisherDeclaration, PullDeclaration
from busflow.errors import InvalidParameter, LaunchError
from busflow.handlers import Handler, SubscriptionRole
from busflow.inheritance import declarations_of
from busflow.launchfile.preflight import Preflight
from busflow.log import Log
from busflow.message import Message, type_name
from busflow.node import default_name, parameters_class
from busflow.parameters import ParameterInfo, describe
from busflow.plugins import load
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.node import Node

Topics = tuple[tuple[str, str], ...]
"""Topic and type."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """What a user of a plugin wants to know before writing it into a launch file."""

    name: str
    summary: str
    file: str
    parameters: tuple[ParameterInfo, ...]
    publishes: Topics
    receives: Topics
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
            "complete": self.complete,
        }

    def print(self) -> None:
        """Print the sheet for a person."""
        click.echo(f"{printable(self.name)}: {printable(self.summary)}\n  {printable(self.file)}")
        tables = {
            "Parameters": [_row(each) for each in self.parameters],
            "Publishes": self.publishes,
            "Receives": self.receives,
        }
        for title, rows in tables.items():
            click.echo(f"\n{title}:" if rows else f"\n{title}: nothing")
            print_columns(rows, indent="  ")
        if not self.complete:
            click.echo("\nA parameter without a default may decide about more topics.")


def sheet(reference: str, folders: Sequence[Path]) -> Sheet:
    """Load a plugin and describe it.

    Raises:
        PluginError: It cannot be found or loaded.
        LaunchError: It cannot declare its endpoints.
    """
    node_class = load(reference, folders)
    try:
        publishes, receives, complete = *_topics(node_class()), True
    except InvalidParameter:
        publishes, receives, complete = *_declared_topics(node_class), False
    return Sheet(
        name=reference,
        summary=(inspect.getdoc(node_class) or "").partition("\n")[0],
        file=shown(inspect.getfile(node_class)),
        parameters=describe(parameters_class(node_class)),
        publishes=publishes,
        receives=receives,
        complete=complete,
    )


def _topics(node: Node) -> tuple[Topics, Topics]:
    """What a node with the default parameters publishes and receives."""
    clock = SystemClock()
    plan = Preflight(clock, Log(clock)).plan(nodes=[node])
    if plan.errors:
        raise LaunchError(plan.errors)
    (member,) = plan.members
    ends = (member.publishers, member.subscriptions)
    published, received = (tuple((each.topic, type_name(each.type)) for each in end) for end in ends)
    return published, received


def _declared_topics(node_class: type[Node]) -> tuple[Topics, Topics]:
    """What the class itself says, where no instance can be made without the user's parameters."""
    published: list[tuple[str, str]] = []
    received: list[tuple[str, str]] = []
    for topic, message_type, direction in _declared(node_class, published, received):
        full = names.expand(topic, node=default_name(node_class), namespace="/")
        direction.append((full, type_name(message_type)))
    return tuple(published), tuple(received)


def _declared(
    node_class: type[Node], published: list[Any], received: list[Any]
) -> Iterator[tuple[str, type[Message], list[Any]]]:
    for declared in declarations_of(node_class).values():
        if isinstance(declared, PublisherDeclaration):
            yield declared.topic, declared.type, published
        elif isinstance(declared, PullDeclaration):
            yield declared.topic, declared.type, received
        elif isinstance(declared, Handler):
            for role in declared.roles:
                if isinstance(role, SubscriptionRole):
                    yield role.topic, declared.message_type(), received


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
