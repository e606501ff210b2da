"""A graph in a test: harness, faults, exploration of schedules, expectations, and the pytest plugin.

Hours on virtual time take milliseconds, and come out the same every time. Starts no process.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from busflow.errors import NotSeen
    from busflow.recording.replay.replay import Replay, replay
    from busflow.runner.loops.virtual import VirtualLoop
    from busflow.runner.loops.virtual_test import virtual_time
    from busflow.testing.exploration import explore
    from busflow.testing.harnesses import Harness, Ledger, harness

_HOMES = {
    "Harness": "busflow.testing.harnesses",
    "Ledger": "busflow.testing.harnesses",
    "NotSeen": "busflow.errors",
    "Replay": "busflow.recording.replay.replay",
    "VirtualLoop": "busflow.runner.loops.virtual",
    "explore": "busflow.testing.exploration",
    "harness": "busflow.testing.harnesses",
    "replay": "busflow.recording.replay.replay",
    "virtual_time": "busflow.runner.loops.virtual_test",
}

__all__ = ["Harness", "Ledger", "NotSeen", "Replay", "VirtualLoop", "explore", "harness", "replay", "virtual_time"]


def __getattr__(name: str) -> object:
    """Import a name when it is first used: a pytest plugin must not make the start of pytest slow."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    # Keep it: each test of a project asks for two of them.
    return globals().setdefault(name, getattr(import_module(_HOMES[name]), name))
