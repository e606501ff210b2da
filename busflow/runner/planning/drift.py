"""`Drift`: a node's parameters that differ from its launch file, and writing them back into the file."""

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
    """Parameter whose value differs from that of a run started from the file."""

    node: NodeSpec
    name: str
    """Dotted: `noise.imu`."""
    stated: object
    """Value in the file, or else the default; plain data."""
    value: object
    """Current value; plain data."""
    origin: Origin
    """Origin of the file's value; `origin.through` is set if it comes from an argument."""


def drifts(spec: NodeSpec, values: Mapping[str, object]) -> tuple[Drift, ...]:
    """Return the current values of a node, given by dotted name, that differ from its launch file's.

    Raises:
        PluginError: The node's plugin cannot be loaded.
        InvalidParameter: The file's own values are wrong, or `values` holds an unknown name.
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
    """Return the text of a launch file with the current values; everything else stays as it was written.

    A value that the file takes from an argument is replaced by the current value. Read the file with `newline=""`.

    Raises:
        LaunchError: A node is not stated in this file, or a value has no place in it.
    """
    found = tuple(found)
    keys = [_key(text, file, drift.node) for drift in found]
    for key, drift in zip(keys, found, strict=True):
        text = edit(text, ("nodes", key, "parameters", *drift.name.split(".")), drift.value)
    return text


def _key(text: str, file: Path, spec: NodeSpec) -> str:
    """Return the key under which the file states a node."""
    place, root = spec.origin.place, parse(text.encode(), str(file))
    here = place is not None and Path(place.file).resolve() == file.resolve()
    for key, value in root.section("nodes").items() if here else ():
        if value.key is None or place is None or (value.key.line, value.key.column) != (place.line, place.column):
            continue
        if "for_each" not in value.members:
            return key
        # A node of a for_each is changed by an entry of its own, named relative to this file's namespace.
        around = f"/{str(own.content).strip('/')}/" if (own := root.members.get("namespace")) and own.content else "/"
        if spec.full_name.startswith(around):  # false if the namespace is an expression
            return spec.full_name.removeprefix(around)
    fix = "write the values by hand" if place is None or here else f"save into {place.file}"
    raise LaunchError([Problem("not-editable", f"{spec.full_name} is not stated in {file}", fix)])
