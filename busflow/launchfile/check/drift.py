"""Drift: where a node's parameters are no longer what its launch file says, and writing them back into the file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from busflow.errors import LaunchError, Problem
from busflow.launchfile.model.description import NodeSpec
from busflow.launchfile.yaml.document import parse
from busflow.launchfile.yaml.edit import edit
from busflow.launchfile.yaml.value import Origin, StatedBy
from busflow.node import plugins
from busflow.node.node import parameters_class
from busflow.node.parameters import describe, unknown, validate, value_of
from busflow.validation.faults import same


@dataclass(frozen=True, slots=True)
class Drift:
    """One parameter whose value is another one than a run started from the file would have."""

    node: NodeSpec
    name: str
    """Dotted: `noise.imu`."""
    stated: object
    """What the file says, or the default where it says nothing; plain data."""
    value: object
    """What it is now; plain data."""
    origin: Origin
    """Where the file states it; `origin.through` is set where it takes it from an argument."""


def drifts(spec: NodeSpec, values: Mapping[str, object]) -> tuple[Drift, ...]:
    """Which of a node's current values, by dotted name, differ from what its launch file comes to.

    Raises:
        PluginError: The node's plugin cannot be loaded.
        InvalidParameter: The file's own values are wrong, or `values` holds a name that is no parameter.
    """
    expected = parameters_class(plugins.load(spec.plugin, spec.folders))
    stated = validate(expected, cast("Mapping[str, object]", spec.parameters.data))
    known = [info.name for info in describe(expected)]
    for name in values.keys() - set(known):
        raise unknown(name, known)
    found: list[Drift] = []
    for name in known:
        if name in values and not same(before := value_of(stated, name), values[name]):
            at = spec.parameters.find(tuple(name.split(".")))
            found.append(Drift(spec, name, before, values[name], Origin(StatedBy.DEFAULT) if at is None else at.origin))
    return tuple(found)


def written_back(text: str, file: Path, found: Iterable[Drift]) -> str:
    """The text of a launch file that states the current values, everything else as it was written.

    A value that the file takes from an argument is stated as it is now. Read the file with `newline=""`.

    Raises:
        LaunchError: A node is not stated in this file, or a value has no place in it.
    """
    found = tuple(found)
    keys = [_key(text, file, drift.node) for drift in found]
    for key, drift in zip(keys, found, strict=True):
        text = edit(text, ("nodes", key, "parameters", *drift.name.split(".")), drift.value)
    return text


def _key(text: str, file: Path, spec: NodeSpec) -> str:
    """The key under which the file states a node."""
    place, root = spec.origin.place, parse(text.encode(), str(file))
    here = place is not None and Path(place.file).resolve() == file.resolve()
    for key, value in root.section("nodes").items() if here else ():
        if value.key is None or place is None or (value.key.line, value.key.column) != (place.line, place.column):
            continue
        if "for_each" not in value.members:
            return key
        # One of several is changed by an entry of its own, with its name as this file would say it.
        around = f"/{str(own.content).strip('/')}/" if (own := root.members.get("namespace")) and own.content else "/"
        if spec.full_name.startswith(around):  # or the namespace is an expression
            return spec.full_name.removeprefix(around)
    fix = "write the values by hand" if place is None or here else f"save into {place.file}"
    raise LaunchError([Problem("not-editable", f"{spec.full_name} is not stated in {file}", fix)])
