"""`busflow tf tree`: draws the frames of a run or a recording, as text, Mermaid, Graphviz or JSON."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.launch_file import DURATION
from busflow.cli.terminal.output import print_answer, print_message, print_problems
from busflow.cli.tf.source import gathered, of_run_or_bag
from busflow.errors import ExitCode
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.frames.edge import Edge
    from busflow.frames.seen import SeenFrames

_EXAMPLES = """\b
Examples:
  busflow tf tree
  busflow tf tree --format mermaid
  busflow tf tree --bag run.mcap --json"""


@click.command(epilog=_EXAMPLES)
@of_run_or_bag
@click.option(
    "--format", "form", type=click.Choice(["text", "mermaid", "dot", "json"]), default="text", show_default=True
)
@click.option("--json", "as_json", is_flag=True, help="The same as --format json.")
@click.option("--for", "for_s", type=DURATION, default="1s", show_default=True, help="How long to listen to a run.")
def tree(run: str | None, bag: Path | None, form: str, as_json: bool, for_s: float) -> int:
    """Draw the tree of frames: what comes on /tf and /tf_static within a second, or is in a recording.

    What is wrong with the frames follows, and the exit code is then 3.
    """
    seen = gathered(run, bag, for_s)
    problems = seen.problems()
    if as_json or form == "json":
        print_answer({**_data(seen), "problems": [each.as_json() for each in problems]})
    elif not seen.tree.edges:
        print_message(f"no transform came within {for_s:g} s" if bag is None else "the recording has no transform")
    else:
        click.echo("\n".join({"text": _text, "mermaid": _mermaid, "dot": _dot}[form](seen)))
    if problems and not (as_json or form == "json"):
        print_problems(problems, error_stream=form != "text")
    return ExitCode.DIFFERENT if problems else ExitCode.OK


def _text(seen: SeenFrames) -> Iterator[str]:
    for root in seen.tree.roots:
        yield printable(root)
        yield from _below(seen, root, "")


def _below(seen: SeenFrames, frame: str, indent: str) -> Iterator[str]:
    edges = list(seen.tree.children(frame))
    for edge in edges:
        is_last = edge is edges[-1]
        yield f"{indent}{'└── ' if is_last else '├── '}{printable(edge.child)}  ({_facts(seen, edge)})"
        yield from _below(seen, edge.child, indent + ("    " if is_last else "│   "))


def _facts(seen: SeenFrames, edge: Edge) -> str:
    rate = "fixed" if edge.fixed is not None else f"{edge.rate_hz:.3g} Hz" if edge.rate_hz else "once"
    by = printable(seen.edges[edge.child].by)
    return f"{rate}, {by}" if by else rate


def _mermaid(seen: SeenFrames) -> Iterator[str]:
    numbers = {frame: f"f{number}" for number, frame in enumerate(sorted(seen.tree.frames))}
    yield "flowchart TD"
    for frame, number in numbers.items():
        yield f'    {number}["{_plain(frame)}"]'
    for child in sorted(seen.tree.edges):
        edge = seen.tree.edges[child]
        yield f'    {numbers[edge.parent]} -->|"{_plain(_facts(seen, edge))}"| {numbers[child]}'


def _dot(seen: SeenFrames) -> Iterator[str]:
    yield "digraph frames {"
    for child in sorted(seen.tree.edges):
        edge = seen.tree.edges[child]
        yield f'    "{_plain(edge.parent)}" -> "{_plain(child)}" [label="{_plain(_facts(seen, edge))}"];'
    yield "}"


def _plain(text: str) -> str:
    """Return a text that needs no quoting in Mermaid and Graphviz."""
    return printable(text).replace("\\", "/").replace('"', "'")


def _data(seen: SeenFrames) -> dict[str, Any]:
    return {
        "roots": seen.tree.roots,
        "frames": [
            {
                "frame": child,
                "parent": edge.parent,
                "fixed": edge.fixed is not None,
                "rate_hz": edge.rate_hz,
                "newest_ns": edge.newest_ns,
                "publishers": list(seen.edges[child].publishers),
                "one_of": seen.edges[child].one_of,
            }
            for child, edge in sorted(seen.tree.edges.items())
        ],
    }
