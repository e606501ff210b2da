"""`busflow certs`: makes and shows the certificates with which machines authenticate each other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from busflow.cli.options.lazy_group import LazyGroup
from busflow.cli.terminal.table import Column, print_table
from busflow.errors import ExitCode
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.wire.machines.certificates import Certificate

_VERBS = {
    "new": ("busflow.cli.certs:new", "Make an authority, whose certificates machines trust."),
    "add": ("busflow.cli.certs:add", "Make a certificate for a machine, or for a person who may inspect runs."),
    "show": ("busflow.cli.certs:show", "Show the certificates, and how long they are valid."),
}
_EXAMPLES = """\b
Examples:
  busflow certs new
  busflow certs add main
  busflow certs add arm --address 192.0.2.7
  busflow certs add viewer
  busflow certs show"""

certs: LazyGroup = LazyGroup("certs", _VERBS, help="Make the certificates that link machines.", epilog=_EXAMPLES)
_FOLDER = click.argument("folder", metavar="[DIR]", default="certs", type=click.Path(path_type=Path))


@click.command(epilog=_EXAMPLES)
@_FOLDER
def new(folder: Path) -> None:
    """Make an authority in DIR, by default `certs`: a key that signs, and its certificate."""
    from busflow.wire.machines.certificates import Authority

    authority = Authority.new(folder)
    shown = printable(folder)
    click.echo(f"Made {shown}/ca.pem and {shown}/ca.key, good until {authority.until:%Y-%m-%d}.")
    click.echo("Anyone with ca.key can sign certificates: keep it here, copy it to no robot. Then, for each machine:")
    click.echo(f"  busflow certs add main {shown}\n  busflow certs add arm {shown} --address 192.0.2.7")


@click.command(epilog=_EXAMPLES)
@click.argument("name")
@_FOLDER
@click.option("--address", "addresses", multiple=True, metavar="HOST", help="Where others connect to it.")
@click.option("--days", type=click.IntRange(1, 3650), default=730, show_default=True, help="How long it is valid.")
@click.option("--replace", is_flag=True, help="Replace an existing certificate; the new one keeps the addresses.")
def add(name: str, folder: Path, addresses: tuple[str, ...], days: int, replace: bool) -> None:
    """Make a certificate and its key in DIR, by default `certs`, for NAME: a machine, or a person with access.

    The machine that runs `busflow run` without --machine has the name main.
    """
    from busflow.wire.machines.certificates import Authority

    made = Authority.open(folder).add(name, addresses=addresses, days=days, replace=replace)
    found = f", found at {', '.join(made.addresses)}" if made.addresses else ""
    click.echo(f"Made {printable(made.cert)} and {printable(made.key)}{found}, good until {made.until:%Y-%m-%d}.")
    click.echo(f"Copy ca.pem, {name}.pem and {name}.key to the computer of {name}, the key with scp or on a stick.")
    click.echo("In the launch file, with the path from the launch file's folder:")
    click.echo(f"  network:\n    ca: {printable(folder)}/ca.pem")
    if made.addresses:
        click.echo(f"  machines:\n    {name}:\n      connect: tls/{_bracketed((addresses or made.addresses)[0])}:7447")
    elif name != "main":
        click.echo(f"and, if {name} is a person who may inspect runs:\n    allow:\n      {name}: read")


@click.command(epilog=_EXAMPLES)
@_FOLDER
def show(folder: Path) -> int:
    """Show the certificates in DIR, by default `certs`; exit code 3 if one of them is not trusted."""
    from busflow.wire.machines.certificates import Authority

    authority = Authority.open(folder, to_sign=False)
    made = authority.certificates()
    state = Column("STATE", folds=True)
    print_table(map(_row, made), Column("NAME"), Column("ADDRESSES", folds=True), Column("UNTIL"), state)
    return ExitCode.DIFFERENT if any(each.fault for each in made) else ExitCode.OK


def _row(made: Certificate) -> tuple[object, ...]:
    state = made.fault or ("good" if made.key.exists() else "good; its key is elsewhere")
    return made.name, ", ".join(made.addresses) or "-", f"{made.until:%Y-%m-%d}", state


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host
