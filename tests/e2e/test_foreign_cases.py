"""Bad input and faults that need a process: its environment, its limits, and what it prints."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

TALKER = """
import os
from pathlib import Path

from busflow import Node

TEXT = "%s%n {0.__class__} %(x)s [red]x[/red] [link=a]"


class Talker(Node):
    async def start(self) -> None:
        self.log.info(TEXT)
        self.log.info("two\\n18:00:00.000 error lines")
        inodes = {link[8:-1] for fd in Path("/proc/self/fd").iterdir() if (link := name(fd)).startswith("socket:")}
        tables = [Path(f"/proc/self/net/{kind}").read_text() for kind in ("tcp", "tcp6", "udp", "udp6")]
        found = [line for table in tables for line in table.splitlines()[1:] if line.split()[9] in inodes]
        self.log.info("sockets", count=len(found))


def name(fd: Path) -> str:
    return os.readlink(fd) if os.path.islink(fd) else ""
"""
ZENOH = '{mode: "peer", listen: {endpoints: ["tcp/0.0.0.0:0"]}, scouting: {multicast: {enabled: true}}}'


@pytest.mark.skipif(not Path("/proc/self/net/tcp").exists(), reason="needs Linux's /proc")
def test_environment_and_limits_change_no_run(tmp_path: Path):
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins/talker.py").write_text(TALKER)
    (tmp_path / "talk.yaml").write_text("plugins: [plugins]\nnodes: {talker: {plugin: talker}}\n")
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


BIG = """
import numpy as np

from busflow import Node, publisher, subscription
from busflow.msgs.sensor_msgs import Image


class Big(Node):
    out = publisher(Image, "image")

    async def run(self) -> None:
        while not self.out.is_received:
            await self.clock.sleep(0.1)
        image = Image(data=np.zeros(300_000_000, dtype=np.uint8))
        self.out.publish(image)
        await self.clock.sleep(0.1)
        self.out.publish(image)


class Watcher(Node):
    @subscription("image")
    def on_image(self, image: Image) -> None: ...
"""


@pytest.mark.long
def test_message_too_large_to_send_is_named(tmp_path: Path):
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins/big.py").write_text(BIG)
    (tmp_path / "big.yaml").write_text("plugins: [plugins]\nshutdown: {grace: 20s}\nprocesses: {other: {}}\nnodes:\n")
    with (tmp_path / "big.yaml").open("a") as file:
        file.write("  big: {plugin: 'big:Big'}\n  watcher: {plugin: 'big:Watcher', process: other}\n")
    command = [sys.executable, "-m", "busflow", "run", "big.yaml", "--for", "8s"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    said = "a message on /image cannot leave the process: 300,000,"
    assert run.stderr.count(said) == 1, run.stderr
    assert "not sent to other processes: too large, or not encodable" in run.stdout
