"""A recorder that is killed loses no more than its last second; `benchmarks/recording_kills.py` goes on for longer."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOAK = ROOT / "benchmarks/recording_kills.py"
KILLS = 100


@pytest.mark.timeout(180)
def test_a_hundred_killed_recorders_leave_files_that_open_and_lack_a_second_at_most():
    # In a process of its own, since it forks: pytest's may have threads.
    done = subprocess.run([sys.executable, SOAK, str(KILLS), "0.8"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{KILLS} kills, 0 of which left less than is promised" in done.stdout
