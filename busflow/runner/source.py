"""Source of a run as plain data: a launch file with its overrides, or one plugin."""

from __future__ import annotations

import os
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from busflow.launchfile.model.description import Examined, LaunchDescription


@dataclass(frozen=True, slots=True)
class Source:
    """A launch file with its overrides, or one plugin in its place, which each process of a run reads for itself."""

    file: Path
    assignments: tuple[str, ...] = ()
    """`name:=value` texts."""
    sets: tuple[str, ...] = ()
    """`path=value` texts of `--set`."""
    profiles: tuple[str, ...] = ()
    args: Mapping[str, object] = field(default_factory=dict[str, object])
    """Arguments of the file as values, which a program gives."""
    plugin: str = ""
    """The plugin of a graph of one node; empty for a launch file."""
    node: str | None = None
    """Name of that node; the name of its class if None."""
    folder: Path | None = None
    remaps: tuple[str, ...] = ()

    def absolute(self) -> Self:
        """Return the same source for a process that may start in another folder."""
        return replace(self, file=self.file.absolute(), folder=self.folder and self.folder.absolute())

    def read(self, environment: Mapping[str, str] | None = None) -> Examined:
        """Read it in this environment; return the description of its valid part, and all problems."""
        if self.plugin:
            return self._read_plugin()
        from busflow.launchfile.load.load import examine
        from busflow.node.plugins import names

        return examine(
            self.file,
            args=self.args,
            assignments=self.assignments,
            sets=self.sets,
            profiles=self.profiles,
            environment=environment,
            plugins=names,
        )

    def _read_plugin(self) -> Examined:
        from busflow.launchfile.load.single_node import examine_single_node
        from busflow.node.node import default_name
        from busflow.node.plugins import load

        beside = Path("plugins")
        folders = [self.folder] if self.folder else [beside] if beside.is_dir() else []
        return examine_single_node(
            self.plugin,
            self.node or default_name(load(self.plugin, tuple(folders))),
            folders=folders,
            parameters=self.assignments,
            remaps=self.remaps,
            sets=self.sets,
        )


@contextmanager
def variables_of(descriptions: Sequence[LaunchDescription]) -> Generator[None]:
    """Set the environment variables that launch files state, and restore the environment at the end."""
    stated = {name: value for each in descriptions for name, value in each.environment.items()}
    before = {name: os.environ.get(name) for name in stated}
    os.environ.update(stated)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value
