"""Options for the parts of a message to print and the format, shared by `topic echo` and `bag echo`."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import click

_OPTIONS = (
    click.option("--field", metavar="PATH", help="Print only this part: linear_acceleration.z, position[0]."),
    click.option(
        "--filter", "filter_", metavar="EXPR", help="Print only messages for which this is true: m.data > 0.5."
    ),
    click.option("--csv", is_flag=True, help="Print the values of a message on one line, separated by commas."),
    click.option("--raw", is_flag=True, help="Print the encoded bytes."),
    click.option("--flow-style", is_flag=True, help="Print each sequence on one line."),
    click.option("--no-arr", is_flag=True, help="Print only the type and length of sequences."),
    click.option("--no-str", is_flag=True, help="Print only the length of texts."),
    click.option("-f", "--full-length", is_flag=True, help="Print long sequences and texts to their end."),
    click.option(
        "-l",
        "--truncate-length",
        type=click.IntRange(min=0),
        help="Where to cut sequences and texts.  [default: 128]",
    ),
)


def wants(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options to a command that has `--json`; the command receives them as one `wanted`."""

    @wraps(command)
    def asked(
        *,
        field: str | None,
        filter_: str | None,
        csv: bool,
        raw: bool,
        flow_style: bool,
        no_arr: bool,
        no_str: bool,
        full_length: bool,
        truncate_length: int | None,
        as_json: bool,
        **others: Any,
    ) -> Any:
        from busflow.cli.terminal.abridged import TRUNCATED_AFTER, Abridger
        from busflow.cli.terminal.message_text import TextForm, Wanted

        forms = {TextForm.CSV: csv, TextForm.RAW: raw, TextForm.FLOW: flow_style, TextForm.JSON: as_json}
        chosen = [form for form, given in forms.items() if given] or [TextForm.YAML]
        if len(chosen) > 1:
            raise click.UsageError("--csv, --raw, --flow-style and --json exclude each other")
        if raw and field:
            raise click.UsageError("--raw prints whole messages; leave --field out")
        whole = full_length or (as_json and truncate_length is None)
        length = None if whole else TRUNCATED_AFTER if truncate_length is None else truncate_length
        return command(wanted=Wanted(chosen[0], Abridger(length, no_arr, no_str), field, filter_), **others)

    for option in reversed(_OPTIONS):
        asked = option(asked)
    return asked
