"""The option `--interfaces` of commands that need types without a class."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click


def takes_interfaces(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add `--interfaces` to a command, once; its folders go into the library of this process."""
    if any(each.name == "interfaces" for each in getattr(command, "__click_params__", ())):
        return command
    return click.option(
        "--interfaces",
        metavar="DIR",
        multiple=True,
        type=click.Path(exists=True, file_okay=False, path_type=Path),
        expose_value=False,
        callback=_named,
        help="A folder of .msg, .srv and .action files, or of packages of them; may be given several times.",
    )(command)


def _named(_context: click.Context, _parameter: click.Parameter, folders: tuple[Path, ...]) -> None:
    if folders:
        from busflow.definitions.folders import name_folders

        name_folders(folders)
