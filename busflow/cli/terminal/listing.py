"""Output of `list` and `find` for what has a name and a type: topics, services and actions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import click

from busflow.cli.terminal.output import print_found
from busflow.cli.terminal.table import print_text
from busflow.errors import NoSuchTarget
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.wire.client.actions import ActionView
    from busflow.wire.client.graph_view import TopicView


def print_list(listed: Sequence[TopicView | ActionView], *, count: bool, show_types: bool) -> None:
    """Print the names, each on a line of its own, or only their number."""
    if count:
        click.echo(len(listed))
        return
    for each in listed:
        print_text(each.name, *([f"[{each.type}]"] if show_types else []), indent="  ")


def print_of_type(
    type_name: str,
    known: Iterable[TopicView | ActionView],
    noun: str,
    *,
    as_json: bool,
    count: bool = False,
    none: str = "there are none",
) -> None:
    """Print the names with a type, or only their number.

    Raises:
        NoSuchTarget: None of those known has this type; `none` is the advice where none is known.
    """
    known = list(known)
    found = [each.name for each in known if type_name in each.types]
    if not found:
        near = did_you_mean(type_name, {type_ for each in known for type_ in each.types}, none=none)
        raise NoSuchTarget(f"no {noun} has the type {printable(type_name)}; {near}")
    print_found({"type": type_name, f"{noun}s": found}, [str(len(found))] if count else found, as_json=as_json)
