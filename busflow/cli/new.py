"""`busflow new`: makes a small project that runs and whose tests pass, from the templates beside this file."""

from __future__ import annotations

import keyword
import re
import shutil
from importlib import resources
from importlib.util import find_spec
from pathlib import Path

import click

from busflow.text import printable

_FILES = {
    "README.md": "README.md.txt",
    "pyproject.toml": "pyproject.toml.txt",
    ".gitignore": "gitignore.txt",
    "plugins/driver.py": "driver.py.txt",
    "configs/my_robot.yaml": "my_robot.yaml.txt",
    "tests/test_driver.py": "test_driver.py.txt",
}
_TEMPLATE_NAME = "my_robot"
"""The project's name in the templates, also in their file names."""
_NAME = re.compile(r"[a-z](?:_?[a-z0-9])*")
_LONGEST = 60


@click.command(epilog="\b\nExamples:\n  busflow new my_robot\n  cd my_robot && busflow run configs/my_robot.yaml")
@click.argument("directory", type=click.Path(path_type=Path))
def new(directory: Path) -> None:
    """Make a small project in DIRECTORY: one plugin, one launch file, and its tests."""
    name = _checked_name(directory)
    try:
        directory.mkdir(parents=True)
    except FileExistsError:
        raise click.ClickException(f"{directory} exists already; choose another name, or remove it") from None
    except OSError as error:
        raise click.ClickException(f"cannot make {directory}: {error.strerror}") from None
    try:
        _write(directory, name)
    except OSError as error:
        shutil.rmtree(directory, ignore_errors=True)  # half a project would make the next attempt fail
        raise click.ClickException(f"cannot write {error.filename or directory}: {error.strerror}") from None
    click.echo(f"Made {printable(directory)}: plugins/driver.py, configs/{name}.yaml, tests/test_driver.py. Next:")
    click.echo(f"  cd {printable(directory)}\n  busflow run configs/{name}.yaml --for 5s\n  pytest")


def _checked_name(directory: Path) -> str:
    """Return the project's name, which is the directory's name and also the ROS package of its messages."""
    name = directory.name
    if name in {"", ".."} and directory.exists():
        raise click.ClickException(f"{directory} is there already: name a new folder, such as my_robot")
    if _is_name(name):
        return name
    proposal = re.sub(r"[^a-z0-9]+", "_", name.lower()).lstrip("_0123456789")[:_LONGEST].rstrip("_")
    raise click.ClickException(
        f"{name[:_LONGEST]!r} cannot name a project: use at most {_LONGEST} lower-case letters, digits and single '_', "
        "a letter first, and no keyword or Python package" + (f"; try {proposal}" if _is_name(proposal) else "")
    )


def _is_name(name: str) -> bool:
    is_word = bool(_NAME.fullmatch(name)) and len(name) <= _LONGEST and not keyword.iskeyword(name)
    # To install the project would take a package's place. A folder without code has no origin.
    return is_word and getattr(find_spec(name), "origin", None) is None


def _write(directory: Path, name: str) -> None:
    templates = resources.files("busflow.cli") / "templates"
    for target, template in _FILES.items():
        path = directory / target.replace(_TEMPLATE_NAME, name)
        path.parent.mkdir(exist_ok=True)
        text = (templates / template).read_text(encoding="utf-8")
        path.write_text(text.replace(_TEMPLATE_NAME, name), encoding="utf-8")
