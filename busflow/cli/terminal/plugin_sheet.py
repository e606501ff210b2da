"""Sheet: the data sheet of one plugin: its parameters, topics and services."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click

from busflow.bus import names
from busflow.cli.terminal.table import Column, print_table, print_text
from busflow.clock import SystemClock
from busflow.errors import BusflowError, InvalidParameter, LaunchError, PluginError
from busflow.interfaces.message import Message, ServiceType, type_name
from busflow.launchfile.model.supervision import Supervision
from busflow.log import Log
from busflow.node.declarations import ClientDeclaration, PublisherDeclaration, PullDeclaration
from busflow.node.handlers import Handler, ServiceRole, SubscriptionRole, declarations_of
from busflow.node.node import Node, default_name, parameters_class
from busflow.node.parameters import ParameterInfo, describe
from busflow.node.plugins import load
from busflow.runner.planning.preflight import Preflight, problem_in_code
from busflow.text import printable
from busflow.validation.tracebacks import shown

_OF_SERVICES = ("serves", "calls")


@dataclass(frozen=True, slots=True)
class Sheet:
    """The description of a plugin for authors of launch files."""

    name: str
    summary: str
    file: str
    parameters: tuple[ParameterInfo, ...]
    ends: Mapping[str, Sequence[tuple[str, str]]]
    """The topics that it `publishes` and `receives`, the services that it `serves` and `calls`, each with its type."""
    complete: bool
    """False if a parameter without a default may add topics or services."""

    def as_json(self) -> dict[str, Any]:
        """Return the sheet as `--json` prints it."""
        return {
            "name": self.name,
            "summary": self.summary,
            "file": self.file,
            "parameters": [_parameter_json(each) for each in self.parameters],
            **{
                verb: [{"service" if verb in _OF_SERVICES else "topic": name, "type": type_} for name, type_ in found]
                for verb, found in self.ends.items()
            },
            "complete": self.complete,
        }

    def print(self) -> None:
        """Print the sheet for a person."""
        print_text(": ".join(filter(None, [self.name, self.summary])), indent="  ")
        print_text(f"  {self.file}")
        tables = {
            "Parameters": [_row(each) for each in self.parameters],
            **{verb.title(): rows for verb, rows in self.ends.items() if rows or verb not in _OF_SERVICES},
        }
        for title, rows in tables.items():
            click.echo(f"\n{title}:" if rows else f"\n{title}: nothing")
            last = (Column(),) * (len(rows[0]) - 1) if rows else ()
            print_table(rows, *last, Column(folds=True), indent="  ")
        if not self.complete:
            click.echo()
            print_text("A parameter without a default may add topics and services.")


def sheet(reference: str, folders: Sequence[Path]) -> Sheet:
    """Load a plugin and describe it.

    Raises:
        PluginError: It cannot be found, loaded or built.
        LaunchError: It cannot declare its endpoints.
    """
    node_class = load(reference, folders)
    try:
        ends, complete = _ends(node_class()), True
    except InvalidParameter:
        ends, complete = _declared_ends(node_class), False
    except BusflowError:
        raise
    except (Exception, SystemExit) as error:  # noqa: BLE001  # a plugin may raise anything
        raise PluginError(problem_in_code(error, f"{printable(reference)} cannot be built")) from None
    return Sheet(
        name=reference,
        summary=inspect.cleandoc(node_class.__doc__ or "").partition("\n")[0],
        file=shown(inspect.getfile(node_class)),
        parameters=describe(parameters_class(node_class)),
        ends=ends,
        complete=complete,
    )


def _ends(node: Node) -> dict[str, list[tuple[str, str]]]:
    """Return the endpoints of a node with the default parameters, by verb."""
    clock = SystemClock()
    plan = Preflight(clock, Log(clock)).plan(nodes=[(node, Supervision())])
    if plan.errors:
        raise LaunchError(plan.errors)
    (planned,) = plan.nodes
    return {
        "publishes": [(each.topic, type_name(each.type)) for each in planned.publishers],
        "receives": [(each.topic, type_name(each.type)) for each in planned.subscriptions],
        "serves": [(each.service, type_name(each.type)) for each in planned.servers],
        "calls": [(each.service, type_name(each.type)) for each in planned.clients],
    }


def _declared_ends(node_class: type[Node]) -> dict[str, list[tuple[str, str]]]:
    """Return the endpoints that the class declares, by verb, for a class that needs the user's parameters."""
    found: dict[str, list[tuple[str, str]]] = {"publishes": [], "receives": [], "serves": [], "calls": []}
    for verb, name, kind in _declared(node_class):
        full = names.expand(name, node=default_name(node_class), namespace="/")
        found[verb].append((full, type_name(kind)))
    return found


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
