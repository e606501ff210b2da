"""A launch file as one, with its includes merged and each node's parameters completed."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from busflow.errors import PluginError
from busflow.launchfile.yaml.value import Origin, StatedBy, Value
from busflow.node.node import parameters_class
from busflow.node.parameters import describe
from busflow.node.plugins import load

if TYPE_CHECKING:
    from busflow.launchfile.model.description import LaunchDescription


def resolve(description: LaunchDescription) -> Value:
    """Return the description as one file, with each node's parameters completed by its plugin's defaults.

    A node whose plugin cannot be loaded is shown as the files state it; `busflow check` reports the reason.
    """
    default = Origin(StatedBy.DEFAULT)
    resolved = description.resolved or Value({}, default)
    for spec in description.nodes:
        with suppress(PluginError):
            for parameter in describe(parameters_class(load(spec.plugin, spec.folders))):
                path = ("nodes", spec.full_name.removeprefix("/"), "parameters", *parameter.name.split("."))
                if not parameter.required and resolved.find(path) is None:
                    resolved = resolved.with_member(path, Value.of(parameter.default, default))
    return resolved
