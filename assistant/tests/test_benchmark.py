"""The benchmark of the assistant works from end to end; how well it answers, the question sets say."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_benchmark_runs_one_short_round():
    command = [sys.executable, "benchmarks/assistant.py", "--quick"]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "the whole book: p50" in ended.stdout
