"""One run from the command line: where its log goes, its report, its table, its exit code."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from busflow.cli.output import colour, json_text, tell
from busflow.cli.summary import print_summary
from busflow.errors import ExitCode, LaunchError, NodeFailed
from busflow.log import console_sink, json_sink
from busflow.runner import Graph, run_graph

if TYPE_CHECKING:
    from busflow.launchfile.description import LaunchDescription


class Run:
    """A graph that is about to run."""

    def __init__(
        self, description: LaunchDescription, *, seed: int | None, strict: bool, verbose: bool, log_format: str
    ) -> None:
        """A run whose log goes to standard error, for people or as JSON."""
        # Standard error is None where the shell closed it: `2>&-`.
        stream = sys.stderr or Path(os.devnull).open("w")  # noqa: SIM115  # it lives as long as the process
        coloured = stream.isatty() if (wanted := colour()) is None else wanted
        sink = json_sink(stream) if log_format == "json" else console_sink(stream, colour=coloured)
        level = "debug" if verbose else "info"
        self._graph = Graph([description], seed=seed, strict=strict, log_level=level, sinks=(sink,))

    def go(self, for_s: float | None, report: Path | None) -> int:
        """Run it to its end, tell what it came to, and return the exit code.

        Raises:
            LaunchError: It cannot run.
        """
        new = report is not None and _made_writable(report)
        try:
            code = run_graph(self._graph, for_s=for_s)
        except NodeFailed:
            code = ExitCode.FAILED
            for failure in self._graph.failures:
                tell(f"error: {failure.render()}")
        except LaunchError:
            if new and report:
                report.unlink(missing_ok=True)  # nothing ran, so there is nothing to report
            raise
        outcome = self._graph.report()
        if report:
            report.write_text(json_text(outcome.as_json()) + "\n", encoding="utf-8")
        print_summary(outcome)
        return code


def _made_writable(path: Path) -> bool:
    """Find out before the run that its report can be written; True where the file was not there before."""
    new = not path.exists()
    try:
        path.open("a", encoding="utf-8").close()
    except OSError as error:
        raise click.BadParameter(f"cannot write {path}: {error.strerror}", param_hint="--report") from None
    return new
