"""What the lock of a run says of its end: one run is killed, another ends itself, and one is elsewhere."""

import os
import subprocess
import sys
from pathlib import Path

from busflow.wire.zenoh.run_directory import RunCard, RunDirectory, runs
from busflow.wire.zenoh.run_lock import RunLock
from tests.wire.conftest import NODES


def test_a_killed_run_abandons_its_lock(directory: Path):
    environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": str(directory)}
    command = [sys.executable, NODES / "claim_run.py", "lab"]
    with subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout
        path = Path(run.stdout.readline().strip())
        lock = RunLock(path)
        before, held = lock.is_abandoned, lock.is_held
        run.kill()
        run.wait()
    assert held
    assert not before
    assert not lock.is_held
    assert lock.is_abandoned
    assert runs({"BUSFLOW_RUNTIME_DIR": str(directory)}) == []
    assert not path.exists(), "the search has removed what the run left"
    assert lock.is_abandoned
    lock.close()


def test_a_run_that_ends_itself_abandons_nothing(directory: Path):
    run = RunDirectory.claim("lab", {"BUSFLOW_RUNTIME_DIR": str(directory)})
    run.write_card(RunCard("lab", os.getpid(), 1))
    lock = RunLock(run.path)
    assert not lock.is_abandoned
    run.close()
    assert not lock.is_abandoned
    again = RunDirectory.claim("lab", {"BUSFLOW_RUNTIME_DIR": str(directory)})
    assert not lock.is_abandoned, "the next run has a lock of its own"
    again.close()
    lock.close()


def test_a_run_elsewhere_has_no_lock(tmp_path: Path):
    for directory in (None, tmp_path / "nowhere"):
        lock = RunLock(directory)
        assert not lock.is_abandoned
        lock.close()
