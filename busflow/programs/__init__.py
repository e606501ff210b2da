"""Programs of a run, in any language: starts them, restarts them, logs what they print, and leaves none behind.

Knows nothing of what a program does, and gives it no messages. A run without `programs:` imports
nothing of this package.

The main process of a machine has `Programs` as an extension of its graph. A `Program` waits for what it depends on, and
for each of its lives starts a `keeper`: a process of the standard library alone, which starts the program in a session
of its own, is its parent and that of all it leaves behind, and ends when none of these is left. The keeper's standard
input is a pipe from the run; it is the order to stop, and its end is that order too. So a program stops in the same
way whether the run ends it, ends by itself, or is killed. Standard output and error go straight to the run, whose
thread reads them (`Child`), so neither a busy event loop nor the keeper delays the program.

At the end of a run a program is stopped when all nodes and programs that depend on it have ended.
docs/decisions/0042 has the reasons.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from busflow.runner.assembly import Run


def attach_programs(run: Run) -> None:
    """Let a run start the programs of its process."""
    from busflow.programs.programs import Programs

    specs = [spec for each in run.placements for spec in each.programs.get(each.main, ())]
    run.graph.attach(Programs(run.graph, specs))
