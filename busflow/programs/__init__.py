"""Programs of a run, in any language: starts them, restarts them, logs what they print, and leaves none behind.

Knows nothing of what a program does, and gives it no messages. A run without `programs:` imports
nothing of this package but this module.

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

from busflow.launchfile.model.description import ClockMode

if TYPE_CHECKING:
    from collections.abc import Iterable

    from busflow.launchfile.model.placement import Placement
    from busflow.runner.graph import Graph


def attach_programs(graph: Graph, placements: Iterable[Placement]) -> None:
    """Let a graph start the programs of its process, unless its time is simulated: programs live in real time alone."""
    specs = [spec for each in placements for spec in each.programs.get(each.main, ())]
    follows = any(each.clock.mode is ClockMode.FOLLOW for each in graph.descriptions)
    if specs and (graph.clock.kind == "system" or follows):
        from busflow.programs.programs import Programs

        graph.attach(Programs(graph, specs))
