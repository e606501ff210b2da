"""A graph of one node without a launch file: its plugin, parameters and remaps are all from the command line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from busflow.launchfile.load import arguments, override
from busflow.launchfile.load.build import Builder
from busflow.launchfile.load.files import Files
from busflow.launchfile.load.merge import Part, named
from busflow.launchfile.load.override import COMMAND_LINE, Override
from busflow.launchfile.model.description import Examined, LaunchDescription
from busflow.launchfile.model.key_faults import checked
from busflow.launchfile.model.problems import Problems
from busflow.launchfile.yaml.document import parse_value
from busflow.launchfile.yaml.value import Origin, StatedBy, StatedPath, Value


def examine_single_node(
    plugin: str,
    name: str,
    *,
    folders: Sequence[Path] = (),
    parameters: Iterable[str] = (),
    remaps: Iterable[str] = (),
    sets: Iterable[str] = (),
) -> Examined:
    """Return the description of one node, and every problem, as a launch file with this node would give them.

    Args:
        plugin: The node's plugin.
        name: The node's name, with its namespace if it has one.
        folders: Plugin folders.
        parameters: `name:=value` texts of a command line; a nested name has dots.
        remaps: `old:=new` texts.
        sets: `path=value` texts of `--set`.
    """
    problems = Problems()
    origin = Origin(StatedBy.COMMAND_LINE)
    key = name.strip("/")
    stated: Mapping[str, object] = {"nodes": {key: {"plugin": plugin, "remap": {}, "parameters": {}}}}
    part = Part(Value.of(stated, origin), [StatedPath(folder, origin) for folder in folders])
    part = named(part, "/", problems)
    (key,) = part.nodes.members
    changes = [
        *_parameters(key, parameters, problems),
        *_remaps(key, remaps, problems),
        *override.parsed(sets, problems),
    ]
    files = Files(problems)
    description: LaunchDescription | None = None
    with problems.collecting():
        completed = override.with_parameter_files(changes, part.tree, files)
        keys, part.tree = checked(override.applied(part.tree, completed, problems), problems)
        description = Builder(part, keys, problems).build(key.rpartition("/")[2], ())
    return description, problems.sorted(())


def _parameters(key: str, texts: Iterable[str], problems: Problems) -> Iterator[Override]:
    for name, stated in arguments.from_command_line(texts, problems).items():
        with problems.collecting():
            value = parse_value(str(stated.content), COMMAND_LINE, f"{name}:=")
            yield Override(
                ("nodes", key, "parameters", *name.split(".")), Value(value.content, value.origin, stated.key)
            )


def _remaps(key: str, texts: Iterable[str], problems: Problems) -> Iterator[Override]:
    for old, new in arguments.from_command_line(texts, problems).items():
        yield Override(("nodes", key, "remap", old), new)
