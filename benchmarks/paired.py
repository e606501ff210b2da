"""Paired: the questions asked of two commits in turn, A B A B …, so that a small difference shows on a busy machine.

Each commit has a checkout and an environment in a temporary folder, with busflow installed there. Both commits use the
installed dependencies and the benchmarks of this tree, so that only busflow differs, with its plugins and launch files.
"""

from __future__ import annotations

import math
import os
import shutil
import site
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import venv
from collections.abc import Callable, Iterator, Sequence
from io import BytesIO
from pathlib import Path
from statistics import median

from benchmarks.question import Effort, find
from benchmarks.record import build
from benchmarks.rounds import ROOT, Outcome, Place, ask_at
from benchmarks.tables import amount

IDENTITY = ("-c", "user.name=benchmarks", "-c", "user.email=benchmarks@localhost")


def output(*command: str, cwd: Path = ROOT) -> bytes:
    """Return the output of a command; its error ends the program."""
    ended = subprocess.run(command, cwd=cwd, check=False, stdout=subprocess.PIPE)  # noqa: S603  # our own commands
    return ended.stdout if not ended.returncode else sys.exit(f"failed: {' '.join(command)}")


def install(commit: str, folder: Path) -> Place:
    """Check a commit out, and install it beside the dependencies that are installed here."""
    root, environment = folder / "checkout", folder / "environment"
    with tarfile.open(fileobj=BytesIO(output("git", "archive", commit))) as files:
        files.extractall(root, filter="data")
    shutil.rmtree(root / "benchmarks")
    shutil.copytree(ROOT / "benchmarks", root / "benchmarks", ignore=shutil.ignore_patterns("__pycache__"))
    venv.create(environment, symlinks=True)
    packages = Path(sysconfig.get_path("purelib", "venv", {"base": str(environment)}))
    (packages / "dependencies.pth").write_text("\n".join(site.getsitepackages()), encoding="utf-8")
    output(sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder), cwd=root)
    shutil.unpack_archive(next(folder.glob("*.whl")), packages, "zip")
    python = str(environment / "bin/python")
    output(python, "-m", "compileall", "-q", "busflow", "benchmarks", cwd=root)
    return Place(root, python)


def lines(first: Outcome, second: Outcome) -> Iterator[str]:
    """Yield a line for each figure: the median of each commit, and the ratios of the second to the first, by pairs."""
    for key in dict.fromkeys([*first.figures, *second.figures]):
        one, two = first.figures.get(key), second.figures.get(key)
        name = " ".join([*key[:2], *key[2].split()[:-1]])
        if one is None or two is None or len(one.values) != len(two.values):
            yield f"{name:64} failed in some rounds"
            continue
        ratios = [b / a for a, b in zip(one.values, two.values, strict=True) if a] or [math.nan]
        spread = "".join(f"{each:9.3f}" for each in (min(ratios), median(ratios), max(ratios)))
        yield f"{name:64}{amount(one.median, one.unit):>10}{amount(two.median, two.unit):>10}{spread}"


def compare(commit: str, names: Sequence[str], effort: Effort, tell: Callable[[str], None]) -> Iterator[str]:
    """Measure the tracked files of this tree beside a commit, and yield the lines to print."""
    os.environ.pop("PYTHONPATH", None)  # else both would run the busflow that it names
    short = output("git", "rev-parse", "--short", f"{commit}^{{commit}}").decode().strip()
    here = output("git", *IDENTITY, "stash", "create").decode().strip() or "HEAD"
    with tempfile.TemporaryDirectory() as folder:
        places = [install(short, Path(folder, "commit")), install(here, Path(folder, "here"))]
        yield build()
        for name in names:
            question = find(name)
            contenders = [each for each in question.contenders if each.name.startswith("busflow")]
            first, second = ask_at(places, question, contenders, effort, tell)
            yield f"\n{question.title}, {effort.rounds} rounds; load {first.load[0]:.1f} → {first.load[1]:.1f}"
            yield f"{'':64}{short:>10}{'here':>10}{'here ÷':>9}{short:>9}"
            yield f"{'':64}{'median':>10}{'median':>10}{'least':>9}{'median':>9}{'most':>9}"
            yield from lines(first, second)
            for where, outcome in ((short, first), ("here", second)):
                for what, why in (outcome.missing | outcome.failed).items():
                    yield f"failed: {where}: {what}: {why}"
