"""The analysis receives every value, in one process on virtual time and in two on the system's."""

import json
import subprocess
import sys
from pathlib import Path

from busflow.msgs.std_msgs import Float64
from busflow.testing import harness, virtual_time

FILE = Path(__file__).parent / "two_processes.yaml"


@virtual_time
async def test_a_frequency_comes_each_second():
    async with harness(FILE) as lab:
        await lab.advance(10)
        assert len(lab.received("value", Float64)) == 1000
        assert all(1 <= each.data <= 50 for each in lab.received("strongest_hz", Float64))
        assert len(lab.received("strongest_hz", Float64)) == 10


def test_every_value_is_accounted_for(tmp_path: Path):
    report = tmp_path / "report.json"
    command = [sys.executable, "-m", "busflow", "run", str(FILE), "--for", "0.5s", "--report", str(report)]
    subprocess.run(command, check=True, timeout=60, capture_output=True)
    topics = {topic["name"]: topic for topic in json.loads(report.read_text())["topics"]}
    (line,) = topics["/value"]["subscriptions"]
    assert line["delivered"] > 0
    assert line["published"] == line["delivered"] + line["dropped"] + line["queued"]
