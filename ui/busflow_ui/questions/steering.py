"""Steering: what a page changes in a run: parameters, nodes, log levels; and in its launch file, shown before."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from difflib import unified_diff
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from busflow.commands import (
    launch_key,
    order_nodes,
    plugin_places,
    saved_key,
    saved_parameters,
    set_log_level,
    stated_parameters,
)
from busflow.errors import BusflowError, InspectionUnavailable, MalformedMessage, NoSuchTarget, ServiceError
from busflow.text import printable
from busflow_ui.questions import arguments as checked

if TYPE_CHECKING:
    from busflow.commands import LaunchFileEdit, Peer

_KEY = "x-ui"
"""Key of a launch file that holds the page's layout; keys that begin with `x-` are free."""
_MOST_LAYOUT = 64_000
_ORDERS = ("start", "stop", "restart")
_LEVELS = ("debug", "info", "warning", "error", "critical")
_Arguments = Mapping[str, Any]


class Steering:
    """Changes of one run. Each method blocks until the run answers."""

    def __init__(self, peer: Peer, ask: Callable[..., Awaitable[Any]], call: Callable[..., Awaitable[Any]]) -> None:
        """Steer a run.

        Args:
            peer: a member of it.
            ask: calls a function in a thread, one after another.
            call: calls a function in a thread, in parallel: one that waits for nodes.
        """
        self._peer, self._ask, self._call = peer, ask, call

    async def parameters(self, arguments: _Arguments) -> object:
        """Return a node's parameters, declared, with the launch file's `file_value`: `{node, parameters}`."""
        node = checked.text(arguments, "node")
        for answer in await self._ask(lambda: self._peer.ask("parameters", node=node)):
            if node in answer:
                stated = await self._call(self._stated, node)
                rows = [{**row, **_file_value(row, stated)} for row in answer[node]]
                return {"node": node, "parameters": rows}
        raise NoSuchTarget(f"{printable(node, limit=200)} has no parameters of busflow's")

    def _stated(self, node: str) -> Mapping[str, Any] | None:
        """Return what the launch file states for a node; None where it is gone, or does not have it."""
        try:
            return stated_parameters(Path(self._peer.run.card.file)).get(node)
        except (BusflowError, OSError):
            return None

    async def set_parameters(self, arguments: _Arguments) -> object:
        """Set parameters of a node, all or none: `{changed, faults}`."""
        node, values = checked.text(arguments, "node"), checked.mapping(arguments, "values")
        answers = await self._ask(lambda: self._peer.ask("set_parameters", node=node, values=values))
        return answers[0]

    async def save_parameters(self, arguments: _Arguments) -> object:
        """Write changed parameters into the launch file, or show how it would change: `{file, edit, saved}`."""
        nodes, is_dry = checked.texts(arguments, "nodes"), checked.flag(arguments, "dry_run")
        edit: LaunchFileEdit = await self._call(lambda: saved_parameters(self._peer, nodes or self._stated_nodes()))
        return await self._written(edit, is_dry=is_dry)

    async def order(self, arguments: _Arguments) -> object:
        """Start, stop or restart a node, and wait until it did: `{node, state, failures}`."""
        node, order = checked.text(arguments, "node"), checked.one_of(arguments, "order", _ORDERS)
        _, after = await self._call(lambda: order_nodes(self._peer, order, [node]))
        (now,) = after.values()
        return {"node": now["name"], "state": now["state"], "failures": now["failures"]}

    async def log_level(self, arguments: _Arguments) -> object:
        """Set the level from which a node logs: `{node, level}`."""
        node, level = checked.text(arguments, "node"), checked.one_of(arguments, "level", _LEVELS)
        name, reason = await self._call(lambda: set_log_level(self._peer, node, level))
        if reason is not None:
            raise ServiceError(f"{name} keeps its level: {reason}")
        return {"node": name, "level": level}

    async def layout(self, _arguments: _Arguments) -> object:
        """Return the layout that the launch file holds: `{layout}`, None where it holds none."""
        return {"layout": await self._call(lambda: launch_key(self._file(), _KEY))}

    async def save_layout(self, arguments: _Arguments) -> object:
        """Write a layout into the launch file, or show how it would change: `{file, edit, saved}`."""
        layout, is_dry = checked.mapping(arguments, "layout"), checked.flag(arguments, "dry_run")
        if len(repr(layout)) > _MOST_LAYOUT:
            raise MalformedMessage(f"a layout has at most {_MOST_LAYOUT} characters")
        edit: LaunchFileEdit = await self._call(lambda: saved_key(self._file(), _KEY, layout))
        return await self._written(edit, is_dry=is_dry)

    async def _written(self, edit: LaunchFileEdit, *, is_dry: bool) -> object:
        """Write an edit unless the page only asks to see it; return the answer."""
        if not is_dry:
            await self._call(edit.write)
        return {"file": str(edit.file), "edit": _difference(edit), "saved": not is_dry}

    def _file(self) -> Path:
        file = Path(self._peer.run.card.file)
        if not file.is_file():
            raise InspectionUnavailable(f"the launch file {printable(file)} is not on this machine")
        return file

    def _stated_nodes(self) -> list[str]:
        stated = plugin_places(self._file()).keys()
        return sorted({node for answer in self._peer.ask("parameters") for node in answer} & stated)


def _file_value(row: Mapping[str, Any], stated: Mapping[str, Any] | None) -> Mapping[str, Any]:
    """Return the value that a run started from the file would have, which is the default where nothing is stated."""
    if stated is None:
        return {}
    level: Any = stated
    for part in row["name"].split("."):
        if not isinstance(level, Mapping) or part not in level:
            return {"file_value": row["default"]}
        level = cast("Mapping[str, Any]", level)[part]
    return {"file_value": level}


def _difference(edit: LaunchFileEdit) -> str:
    """Return what an edit changes, as a unified difference."""
    before, after = edit.before.splitlines(keepends=True), edit.after.splitlines(keepends=True)
    return "".join(unified_diff(before, after, str(edit.file), str(edit.file), n=2))
