"""What killed recorders leave; `benchmarks/recording_kills.py` goes on for longer, and measures what is lost."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SOAK = ROOT / "benchmarks/recording_kills.py"
KILLS, LIVES_S, LOSES_S = 40, 3.0, 60.0
"""That nobody loses more than a second is for an idle machine to show; here, that a file does not wait for its end."""
FIGURES = re.compile(r" (\d+) of +(\d+) ")


@pytest.mark.timeout(180)
@pytest.mark.long
def test_killed_recorders_lose_their_last_moments_only():
    # In a process of its own, since it forks: pytest's may have threads.
    command = [sys.executable, SOAK, str(KILLS), str(LIVES_S), str(LOSES_S)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{KILLS} kills, 0 of which" in done.stdout
    recorded, published = (sum(map(int, each)) for each in zip(*FIGURES.findall(done.stdout), strict=True))
    assert recorded > published / 4 > 0, done.stdout
