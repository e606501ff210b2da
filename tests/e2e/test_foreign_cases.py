"""Bad input and faults that need a process: its environment, its limits, and what it prints."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

NODES = Path(__file__).parents[1] / "nodes"
ZENOH = '{mode: "peer", listen: {endpoints: ["tcp/0.0.0.0:0"]}, scouting: {multicast: {enabled: true}}}'


@pytest.mark.skipif(not Path("/proc/self/net/tcp").exists(), reason="needs Linux's /proc")
def test_environment_and_limits_change_no_run(tmp_path: Path):
    (tmp_path / "talk.yaml").write_text(f"plugins: [{NODES}]\nnodes: {{talker: {{plugin: talker}}}}\n")
    (tmp_path / "zenoh.json5").write_text(ZENOH)
    environment = {**os.environ, "ZENOH_CONFIG": str(tmp_path / "zenoh.json5"), "SECRET_TOKEN": "hunter2-hunter2"}
    command = [sys.executable, "-m", "busflow", "run", "talk.yaml", "--for", "0.3s", "--report", "run.json"]
    done = subprocess.run(
        [*command, "--record", "run.mcap"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64)),
    )
    assert done.returncode == 0, done.stderr
    assert "/talker: %s%n {0.__class__} %(x)s [red]x[/red] [link=a]\n" in done.stderr
    assert "/talker: sockets count=0\n" in done.stderr
    assert r"/talker: two\n18:00:00.000 error lines" in done.stderr
    assert "Traceback" not in done.stderr
    written = [done.stdout.encode(), done.stderr.encode(), *(p.read_bytes() for p in tmp_path.glob("run.*"))]
    assert len(written) == 4
    assert [text for text in written if b"hunter2" in text] == []
