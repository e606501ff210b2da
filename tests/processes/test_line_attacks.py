"""Messages between processes that are killed, and beside clients; `benchmarks/line_attacks.py` does more."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "benchmarks/line_attacks.py"


@pytest.mark.parametrize("attack", ["clients", "kills"])
@pytest.mark.timeout(400)
@pytest.mark.long
def test_messages_arrive_once_whole_and_in_order(attack):
    done = subprocess.run([sys.executable, SCRIPT, "--quick", attack], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
