"""`busflow interface generate` and `export`: classes of definition files, and definition files of classes."""

from __future__ import annotations

from pathlib import Path

import click

from busflow.cli.options.interfaces import takes_interfaces
from busflow.errors import ExitCode
from busflow.text import counted, printable

_GENERATE = """\b
Examples:
  busflow interface generate my_msgs other_msgs --interfaces ../src --to my_robot/msgs
  busflow interface generate my_msgs --interfaces ../src --to my_robot/msgs --check"""
_EXPORT = """\b
Examples:
  busflow interface export my_robot --to ros2/my_robot_msgs"""

_folder = click.Path(file_okay=False, path_type=Path)


@click.command(epilog=_GENERATE)
@click.argument("packages", metavar="PACKAGE...", nargs=-1, required=True)
@click.option(
    "--to", metavar="DIR", type=_folder, required=True, help="The folder of the modules, one for each package."
)
@click.option("--check", "checks", is_flag=True, help="Write nothing; exit code 3 if a module is not what it would be.")
@takes_interfaces
def generate(packages: tuple[str, ...], to: Path, checks: bool) -> int:
    """Write a module of classes for each PACKAGE of definition files: messages, services and actions.

    The packages are found in the folders of --interfaces, in installed packages, and in a sourced ROS 2.
    """
    from busflow.definitions.folders import library, named_folders
    from busflow.definitions.generator import command, generate

    modules = generate(library(), packages, to)
    stale = [each for each in modules if not each.is_current]
    if checks:
        for each in stale:
            click.echo(f"{printable(each.path)} {each.difference}")
        if stale:
            click.echo(f"write them anew: {command([each.path.stem for each in stale], to, named_folders())}")
        return ExitCode.DIFFERENT if stale else ExitCode.OK
    to.mkdir(parents=True, exist_ok=True)
    for each in modules:
        each.path.write_text(each.text, "utf-8")
        click.echo(f"{printable(each.path)}: {counted(each.count, 'type')}{'' if each in stale else ', as before'}")
        for problem in each.left_out:
            click.echo(problem.render())
    return ExitCode.OK


@click.command(epilog=_EXPORT)
@click.argument("name", metavar="MODULE")
@click.option("--to", metavar="DIR", type=_folder, required=True, help="The folder of the package.")
@click.option("--licence", metavar="NAME", default="Apache-2.0", show_default=True, help="What its package.xml states.")
def export(name: str, to: Path, licence: str) -> None:
    """Write the types of the module or Python package MODULE, or of a folder of plugins, as a package for ROS 2.

    It gets their .msg, .srv and .action files, a package.xml and a CMakeLists.txt: a workspace of ROS 2 builds it.
    """
    from busflow.cli.interface.classes import classes_of
    from busflow.definitions.export import exported

    package, classes = classes_of(name)
    for path, text in exported(package, classes, licence).items():
        (to / path).parent.mkdir(parents=True, exist_ok=True)
        (to / path).write_text(text, "utf-8")
        click.echo(printable(to / path))
