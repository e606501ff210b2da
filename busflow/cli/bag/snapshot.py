"""`busflow bag snapshot`: writes the last moments of a running graph as a bag."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.run import joined, joins
from busflow.cli.terminal.output import print_answer, print_message
from busflow.cli.terminal.run_summary import snapshot_line
from busflow.clock import sleep
from busflow.errors import ExitCode, InspectionUnavailable
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.wire.client.client import Peer

_EXAMPLES = """\b
Examples:
  busflow bag snapshot
  busflow bag snapshot --reason "the arm trembles" --json | jq -r .path"""

_LOOK_S = 0.1
"""The interval at which to look whether the file is written."""


@click.command(epilog=_EXAMPLES)
@click.option("--reason", metavar="TEXT", default="busflow bag snapshot", help="What the bag shows, for `bag info`.")
@joins
def snapshot(reason: str, run: str | None, as_json: bool) -> int:
    """Write the last moments of a running graph as a bag, and wait until it is written.

    The launch file says how much is kept: `record: {snapshot: 60s, after: 5s}`. The run writes the file, in its own
    folder. The exit code is 4 if the run keeps nothing, and 5 if something is missing in the bag.
    """
    with joined(run) as peer:
        (begun, *_) = peer.ask("snapshot", reason=reason)
        found = _written(peer, begun)
    if as_json:
        print_answer(found)
    else:
        print_message(snapshot_line(found), error_stream=False)
    return ExitCode.OK if found["complete"] else ExitCode.INCOMPLETE


def _written(peer: Peer, begun: dict[str, Any]) -> dict[str, Any]:
    """Wait until a snapshot is written, and return its report.

    Raises:
        InspectionUnavailable: the run has ended meanwhile, or does not answer.
    """
    while peer.alive:
        reports = [each for report in peer.ask("report") for each in report.get("snapshots", ())]
        found = [each for each in reports if each["path"] == begun["path"] and each["written"]]
        if found:
            return found[0]
        sleep(_LOOK_S)
    path = printable(begun["path"])
    raise InspectionUnavailable(f"the run ended while it wrote {path}: busflow bag verify says what is in it")
