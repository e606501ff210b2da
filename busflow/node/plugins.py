"""Find node classes by name, in plugin folders and among installed entry points, and load them.

A plugin folder is one package (`folders`): its files import each other relatively.
"""

from __future__ import annotations

import importlib
import importlib.util
import opcode
import os
import re
import sys
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, TypeGuard

from busflow.entry_points import entry_points, source_of
from busflow.errors import BusflowError, Place, PluginError, Problem, how_to_install
from busflow.node.folders import PREFIX, file_of, package_of
from busflow.node.plugin_outline import UNREADABLE, Outline, files_with_nodes, sources
from busflow.node.signatures import import_of
from busflow.node.slow_import import slow_import_named
from busflow.text import did_you_mean, quoted
from busflow.validation import tracebacks
from busflow.validation.advice import advice

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from busflow.node.node import Node

GROUP = "busflow.nodes"
"""The entry point group under which an installed distribution offers its nodes."""

_BUILT_IN = {
    "player": "busflow.recording.player.player:Player",
    "robot_state_publisher": "busflow.description.robot_state_publisher:RobotStatePublisher",
    "static_frames": "busflow.frames.static_frames:StaticFrames",
}
_APART = {"assistant": "busflow-assistant", "page_index": "busflow-assistant"}
"""The plugins that another distribution of this project provides, each with its name."""
_NO_CLASS = "write a class there that derives from busflow.Node"
_FILE_NAME = re.compile(r"[^\W\d_][\w-]*")


@dataclass(frozen=True, slots=True)
class PluginSummary:
    """Facts about a plugin that need no import of it."""

    name: str
    """The name after `plugin:` in a launch file."""
    summary: str
    file: str | None
    line: int = 1
    fault: str | None = None
    """The reason why the file cannot be read; it then offers nothing."""


def find(folders: Iterable[str | os.PathLike[str]]) -> list[PluginSummary]:
    """Return the plugins of the folders and the installed ones, sorted by name; nothing is imported.

    Where two have one name, the one that `load` would take is listed.
    """
    found: dict[str, PluginSummary] = {}
    for folder in folders:
        for path in _plugins_in(Path(folder)):
            for summary in _summaries(path):
                found.setdefault(summary.name, summary)
    for entry in entry_points(GROUP):
        found.setdefault(entry.name, _summary_of_installed(entry.name, entry.module, entry.attr))
    return sorted(found.values(), key=lambda summary: summary.name)


def names() -> Iterator[str]:
    """Yield the names of the plugins in `plugins/` of the working directory, and of the installed ones."""
    return (each.name for each in find([Path("plugins")]))


def built_in() -> list[PluginSummary]:
    """Return the nodes that busflow itself offers; a plugin of the same name in a folder goes before them."""
    return [_summary_of_installed(name, *value.split(":")) for name, value in _BUILT_IN.items()]


def load(reference: str, folders: Iterable[str | os.PathLike[str]]) -> type[Node]:
    """Return the node class that a launch file's `plugin:` names.

    Args:
        reference: `x` for the only Node subclass of `x.py`, of `x/` or of an installed entry point,
            `x:Class` where there are several.
        folders: Where to look, before the installed entry points.

    Raises:
        PluginError: It is not there, cannot be imported, or is not exactly one Node subclass.
    """
    name, _, wanted = reference.partition(":")
    places = [Path(folder) for folder in folders]
    paths = {os.path.realpath(path): path for folder in places for path in _plugins_in(folder, name)}
    if len(paths) > 1:
        raise _error(
            "ambiguous-plugin",
            f"plugin {name!r} is in several places: {', '.join(map(tracebacks.shown, paths.values()))}",
            "rename all but one",
        )
    for path in paths.values():
        return _load_from_folder(name, wanted, path)
    if name in _BUILT_IN:
        module, _, attr = _BUILT_IN[name].partition(":")
        return getattr(importlib.import_module(module), attr)
    for entry in entry_points(GROUP):
        if entry.name == name:
            return _load_installed(entry, wanted)
    raise _not_found(name, places)


# Choosing the class -------------------------------------------------------------------------------------


def _load_from_folder(name: str, wanted: str, path: Path) -> type[Node]:
    folder = Path(os.path.realpath(path.parent))
    with _importing(name, folder, path):
        module = importlib.import_module(f"{package_of(folder)}.{name}")
        classes = _nodes_defined(module)
        if path.is_dir() and (wanted not in classes if wanted else not classes):
            for file in files_with_nodes(path):
                classes |= _nodes_defined(importlib.import_module(f"{module.__name__}.{file.stem}"))
    return _choose(name, wanted, module, classes, tracebacks.shown(path))


def _load_installed(entry: EntryPoint, wanted: str) -> type[Node]:
    with _importing(entry.name):
        target = entry.load()
    module = sys.modules[entry.module]
    classes = {entry.attr: target} if _is_node(target) else _nodes_defined(module)
    return _choose(entry.name, wanted, module, classes, f"the installed {entry.value}")


def _choose(name: str, wanted: str, module: ModuleType, classes: dict[str, type[Node]], where: str) -> type[Node]:
    """Return the class that is meant; the error names those that there are."""
    if wanted:
        asked, fix = classes.get(wanted) or vars(module).get(wanted), did_you_mean(wanted, classes, none=_NO_CLASS)
        if _is_node(asked):
            return asked
        if asked is None:
            raise _error("unknown-plugin", f"{where} has no class {quoted(wanted)}", fix)
        raise _error("no-node", f"{quoted(wanted)} in {where} is not a Node subclass", fix)
    public = [each for each in classes if not each.startswith("_")]
    if len(public) == 1:
        return classes[public[0]]
    if public:
        choice = " or ".join(f"`{name}:{each}`" for each in public)
        raise _error("ambiguous-plugin", f"{where} defines several nodes: {', '.join(public)}", f"write {choice}")
    raise _error(
        "no-node",
        f"{where} defines no Node subclass",
        "write `class MyNode(Node):` there, with `from busflow import Node`",
    )


def _nodes_defined(module: ModuleType) -> dict[str, type[Node]]:
    """Return the Node subclasses that a module, or a package's files, define rather than import; by name."""
    nodes = {each.__name__: each for each in vars(module).values() if _is_node(each)}
    inside = module.__name__ + "."
    return {name: each for name, each in nodes.items() if f"{each.__module__}.".startswith(inside)}


def _is_node(value: object) -> TypeGuard[type[Node]]:
    from busflow.node.node import Node

    return isinstance(value, type) and issubclass(value, Node) and value is not Node


# Importing -----------------------------------------------------------------------------------------------


@contextmanager
def _importing(name: str, folder: Path | None = None, file: Path | None = None) -> Generator[None]:
    """Turn what the plugin's own code raises into a `PluginError`, and forget what it had imported."""
    importlib.invalidate_caches()  # a file written a moment ago is not in the finders' listings yet
    before = set(sys.modules)
    with slow_import_named(name, folder):
        try:
            yield
        except BaseException as error:
            _forget(sys.modules.keys() - before, folder)
            if isinstance(error, (Exception, SystemExit)) or _raised_by_statement(error):
                raise PluginError(_import_problem(name, folder, file, error)) from error
            raise


def _forget(names: Iterable[str], folder: Path | None) -> None:
    """Drop the folder's modules, so that the next attempt runs the files again."""
    for name in names:
        module = sys.modules[name]
        file = file_of(module)
        if name.startswith(PREFIX) or (folder and file and folder in Path(file).resolve().parents):
            del sys.modules[name]
            parent, _, child = name.rpartition(".")
            if vars(sys.modules.get(parent, module)).get(child) is module:
                delattr(sys.modules[parent], child)


def _raised_by_statement(error: BaseException) -> bool:
    """Return whether a `raise` statement threw it; the KeyboardInterrupt of a real Ctrl-C comes from none."""
    place = error.__traceback__
    while place and place.tb_next:
        place = place.tb_next
    if not isinstance(error, KeyboardInterrupt) or place is None:
        return False
    return place.tb_frame.f_code.co_code[place.tb_lasti] == opcode.opmap["RAISE_VARARGS"]


# Explaining ----------------------------------------------------------------------------------------------


def _import_problem(name: str, folder: Path | None, file: Path | None, error: BaseException) -> Problem:
    places = tracebacks.places(error, within=folder)
    place = places.pop() if places else Place(tracebacks.shown(file), 1, 1) if file else None
    place = error.place or place if isinstance(error, BusflowError) else place
    text = str(error) if isinstance(error, BusflowError) else tracebacks.reason(error)
    reason = re.sub(re.escape(PREFIX) + r"\w+(?=\.)", "", text)
    code, message, fix = "plugin-import", f"plugin {name!r} cannot be imported: {reason}", advice(error)
    if isinstance(error, SyntaxError):
        code = "plugin-syntax"
    elif isinstance(error, ModuleNotFoundError) and error.name:
        fix = fix or _fix_for_missing(error.name, folder)
    elif isinstance(error, NameError):
        fix = f"write `{found}`" if (found := import_of(str(error.name))) else fix
    elif isinstance(error, (SystemExit, KeyboardInterrupt)):
        message = f"plugin {name!r} ends the program when it is imported: {reason}"
        fix = 'put what runs as a script under `if __name__ == "__main__":`'
    return Problem(code, message, fix, place, included_from=tuple(reversed(places)))


def _fix_for_missing(missing: str, folder: Path | None) -> str:
    """Return the fix for a module that was not found."""
    stems = [path.stem for path in _plugins_in(folder)] if folder else []
    if missing.startswith(PREFIX):
        return did_you_mean(missing.rpartition(".")[2], stems)
    if folder and (stem := missing.removeprefix(f"{folder.name}.")) in stems:
        return f"write `from .{stem} import …`: the files of a plugin folder import each other relatively"
    if missing == "rclpy":
        return "write `from busflow import Node`; docs/coming-from-rclpy.md has the rest, line by line"
    if missing.isidentifier() and importlib.util.find_spec(f"busflow.msgs.{missing}") is not None:
        return f"write `from busflow.msgs.{missing} import …`"
    if missing.startswith("busflow."):  # such as busflow.msgs.std_msgs.msg
        return f"write `from {missing.rpartition('.')[0]} import …`"
    return f"install what provides {missing!r} into the environment {sys.prefix}"


def _not_found(name: str, folders: Sequence[Path]) -> PluginError:
    looked = [tracebacks.shown(folder) + ("" if folder.is_dir() else " (no such folder)") for folder in folders]
    fix = did_you_mean(name, [*(each.name for each in find(folders)), *_BUILT_IN])
    if name in _APART:
        fix = how_to_install("busflow", _APART[name])
    if os.sep in name or name.endswith(".py"):
        fix = f"write {quoted(Path(name).stem)}, and its folder under `plugins:`"
    where = ", ".join([*looked, f"the installed ones (entry points {GROUP})"])
    return _error("unknown-plugin", f"there is no plugin {quoted(name)}; looked in {where}", fix)


def _error(code: str, message: str, fix: str) -> PluginError:
    return PluginError(Problem(code, message, fix))


# Looking without importing -------------------------------------------------------------------------------


def _plugins_in(folder: Path, name: str | None = None) -> list[Path]:
    """Return the `x.py` and `x/` of a folder that may be plugins; only those called `name` if it is given."""
    if name is not None:
        paths = [folder / f"{name}.py", folder / name] if _FILE_NAME.fullmatch(name) else []
    else:
        try:
            paths = sorted(folder.iterdir())
        except OSError:
            return []
    return [path for path in paths if _FILE_NAME.fullmatch(path.name.removesuffix(".py")) and sources(path)]


def _summaries(path: Path) -> list[PluginSummary]:
    name = path.name.removesuffix(".py")
    try:
        found = Outline().of_plugin(path)
    except UNREADABLE as error:
        line = error.lineno or 1 if isinstance(error, SyntaxError) else 1
        return [PluginSummary(name, "", tracebacks.shown(path), line, tracebacks.reason(error))]
    public = [each for each in found if not each.name.startswith("_")]
    return [
        PluginSummary(
            name if len(public) == 1 else f"{name}:{each.name}",
            each.summary,
            tracebacks.shown(each.file),
            each.line,
        )
        for each in public
    ]


def _summary_of_installed(name: str, module: str, attr: str) -> PluginSummary:
    file = source_of(module)
    if file is not None:
        with suppress(*UNREADABLE):
            known = Outline().of_file(file)
            own = (each for each in known.values() if each.file == file)
            found = known.get(attr) or next(own, None)
            if found:
                return PluginSummary(name, found.summary, str(found.file), found.line)
    return PluginSummary(name, "", None)
