"""Entry: `python -m benchmarks` asks every question, of busflow and of what a user would pick instead.

It prints tables; `--json FILE` writes every sample, `--write-docs` the tables and plots of docs/performance.md.
`--paired COMMIT` measures busflow of this tree and of that commit in turn, and prints their ratios.
Install the peers with `pip install --group bench` (pip 25.1 or newer); one that is not there is named as missing.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from rich.console import Console

from benchmarks import page
from benchmarks.paired import compare
from benchmarks.question import FULL, QUESTIONS, QUICK, Effort, find
from benchmarks.record import as_json, machine
from benchmarks.rounds import ask
from benchmarks.tables import show

WIDTH = 170
"""Of the tables, where they go into a file."""


def progress(text: str) -> None:
    """Print what is being measured."""
    print(text, file=sys.stderr, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--only", metavar="QUESTIONS", help=f"some of: {','.join(QUESTIONS)}")
    parser.add_argument(
        "--without-peers", action="store_true", help="leave out what has to be installed besides busflow"
    )
    parser.add_argument("--quick", action="store_true", help="one short round: to see that everything works")
    parser.add_argument("--rounds", type=int, help="how often everything is measured in turn")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every sample to this file")
    parser.add_argument("--write-docs", action="store_true", help="put the tables and plots into docs/performance.md")
    parser.add_argument("--paired", metavar="COMMIT", help="compare this tree with a commit, round by round")
    given = parser.parse_args()
    names = given.only.split(",") if given.only else list(QUESTIONS)
    if unknown := sorted(set(names) - set(QUESTIONS)):
        parser.error(f"no question {', '.join(unknown)}; there are {', '.join(QUESTIONS)}")
    effort = QUICK if given.quick else FULL
    if given.rounds is not None:
        effort = Effort(effort.sample_s, max(1, given.rounds), effort.sizes)
    if given.paired and (given.json or given.write_docs):
        parser.error("--paired prints ratios; it writes no file")
    if given.paired:
        for line in compare(given.paired, names, effort, progress):
            print(line, flush=True)
        return
    console = Console(width=None if sys.stdout.isatty() else WIDTH, highlight=False)
    console.print(machine(), markup=False)
    outcomes = []
    for name in names:
        outcome = ask(find(name), effort, progress, peers=not given.without_peers)
        show(console, outcome)
        outcomes.append(outcome)
    if given.write_docs:
        page.write(outcomes)
    if given.json:
        given.json.write_text(json.dumps(as_json(outcomes), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
