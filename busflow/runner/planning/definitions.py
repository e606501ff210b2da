"""Classes of a graph whose definition files say something else now: what has changed since they were written."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from busflow.definitions.generator import command, is_generated
from busflow.definitions.library import Library
from busflow.errors import BusflowError, InvalidDefinition, Place, Problem
from busflow.interfaces.action import written_type
from busflow.interfaces.encoding.description import IndividualDescription, types_in
from busflow.interfaces.encoding.typesupport import describe
from busflow.interfaces.message import Message, ServiceType, is_ros_type
from busflow.launchfile.model.description import LaunchDescription
from busflow.runner.planning.planned_node import PlannedNode


def definition_problems(description: LaunchDescription, nodes: Sequence[PlannedNode]) -> list[Problem]:
    """Return a problem for each class of an endpoint that differs from its file in a folder of `interfaces`."""
    folders = [each.path for each in description.interfaces]
    library, found = Library(folders), dict[str, list[Problem]]()
    for cls in _classes(nodes):
        for name, described in types_in(describe(cls)).items():
            owner = library.owner(name)
            if owner is not None and name not in found:
                found[name] = list(_compared(cls, owner, described, library, folders))
    return list(dict.fromkeys(problem for each in found.values() for problem in each))


def _classes(nodes: Sequence[PlannedNode]) -> Iterator[type[Message | ServiceType]]:
    """Yield the classes of all endpoints that ROS can describe."""
    for planned in nodes:
        for endpoint in (*planned.publishers, *planned.subscriptions):
            if is_ros_type(endpoint.type):
                yield endpoint.type
        for endpoint in (*planned.servers, *planned.clients):
            if all(is_ros_type(part) for part in (endpoint.type.Request, endpoint.type.Response)):
                yield endpoint.type


def _compared(
    cls: type[Message | ServiceType],
    owner: str,
    described: IndividualDescription,
    library: Library,
    folders: Sequence[Path],
) -> Iterator[Problem]:
    name = described["type_name"]
    try:
        now = library.definition(owner).types().get(name)
    except InvalidDefinition as error:
        yield from error.problems
        return
    except BusflowError as error:
        yield Problem("definition", str(error))
        return
    if now is not None and _fields(now) != _fields(described):
        package = owner.partition("/")[0]
        file = library.packages[package].files[owner]
        module, line = _source(written_type(cls), package)
        fix = "change the class, or the file"
        if module is not None and is_generated(module):
            fix = command([package], module.parent, folders)
        place = Place(str(module), line, 1) if module is not None else None
        yield Problem("definition", f"{file} has changed since the class of {owner} was written", fix, place)


def _fields(described: IndividualDescription) -> list[Any]:
    """Return what a type's hash covers."""
    return [(field["name"], field["type"]) for field in described["fields"]]


def _source(cls: type[Message | ServiceType], package: str) -> tuple[Path | None, int]:
    """Return the file of the module that holds the classes of a package, and a line: of the class if it is there."""
    import sys

    try:
        own = Path(inspect.getfile(cls))
        if cls.__ros_name__.startswith(f"{package}/"):
            return own, inspect.getsourcelines(cls)[1]
    except (OSError, TypeError):
        return None, 1
    beside = sys.modules.get(f"{cls.__module__.rpartition('.')[0]}.{package}")
    return (Path(beside.__file__) if beside is not None and beside.__file__ else own), 1
