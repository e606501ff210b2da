"""What definition files cost: `python benchmarks/definitions.py`.

A folder of 200 definitions is listed and read in this process, and listed by the command, which is timed beside
`busflow --version`. The best of several rounds counts.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import timeit
from collections.abc import Callable
from pathlib import Path

from busflow.definitions.library import Library

PACKAGES = 10
TYPES = 20
QUICK = "--quick" in sys.argv
"""One short round: to see that everything works."""
ROUNDS = 1 if QUICK else 10
TEXT = '# A type.\n\nstd_msgs/Header header  # when\nfloat64[9] gains\nstring<=20 name "a"\nuint8 KIND=1\n'


def main() -> None:
    """Print a line for each measurement."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        for package in range(PACKAGES):
            (folder / f"p{package}_msgs/msg").mkdir(parents=True)
            for number in range(TYPES):
                (folder / f"p{package}_msgs/msg/Type{number}.msg").write_text(TEXT)
        os.environ["BUSFLOW_RUNTIME_DIR"] = made  # the command would ask a run of this machine for its types too
        names = Library([folder]).names
        print(f"{len(names)} definitions")
        print(f"list in this process  {best(lambda: Library([folder]).names):8.1f} ms")
        print(f"read in this process  {best(lambda: read(folder)):8.1f} ms")
        command = [sys.executable, "-m", "busflow"]
        print(f"busflow --version     {best(lambda: run([*command, '--version'])):8.1f} ms")
        listed = [*command, "interface", "list", "--interfaces", str(folder)]
        print(f"busflow interface list{best(lambda: run(listed)):8.1f} ms")


def best(action: Callable[[], object]) -> float:
    """Return the shortest time of an action, in milliseconds."""
    return min(timeit.repeat(action, number=1, repeat=ROUNDS)) * 1000


def read(folder: Path) -> None:
    """Describe all types of a folder."""
    library = Library([folder])
    for name in library.names:
        library.description(name)


def run(command: list[str]) -> None:
    """Run a command, and drop what it prints."""
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603  # its own command


if __name__ == "__main__":
    main()
