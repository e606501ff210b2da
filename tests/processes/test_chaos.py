"""A run whose processes are killed and stopped at random; `python benchmarks/chaos.py` goes on for longer."""

import importlib.util
import sys
from itertools import islice
from math import inf
from pathlib import Path

import pytest

spec = importlib.util.spec_from_file_location("chaos", Path(__file__).parents[2] / "benchmarks/chaos.py")
chaos = importlib.util.module_from_spec(spec)
sys.modules["chaos"] = chaos  # where its dataclass looks for its types
spec.loader.exec_module(chaos)


@pytest.mark.e2e
@pytest.mark.timeout(240)
@pytest.mark.long
def test_a_run_survives_killed_and_stopped_processes(monkeypatch):
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", "")  # which the attack sets; this puts it back
    # How fast it recovers is the benchmark's to judge, on a machine that does nothing else.
    outcome = chaos.chaos(seconds=inf, seed=614, most=3, slowness=20.0)
    assert not outcome.broken, "\n".join(outcome.broken)
    assert outcome.faults == {"SIGKILL": 1, "SIGSTOP": 1, "SIGSEGV": 1}
    assert outcome.restarts >= 2
    assert outcome.marks >= 1
    assert outcome.called > 0


def test_a_seed_stands_for_one_sequence_of_faults():
    first, again, other = ([*islice(chaos.schedule(seed), 100)] for seed in (3, 3, 4))
    assert first == again != other
    assert {fault for _, _, fault, _ in first} == {"SIGKILL", "SIGSTOP", "SIGTERM", "SIGSEGV"}
