"""What a viewer publishes into a run of several processes, right after it has said that it will."""

import json
import os
import re
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect

from tests.processes.conftest import starting
from tests.processes.test_publishing import THREE


@pytest.fixture
def run(tmp_path: Path) -> Iterator[Any]:
    """Three processes that receive a topic; one of them has no time for it but every 0.1 s."""
    with starting(tmp_path) as start:
        run = start(THREE, "--watchdog", "off")
        run.wait_for("listens", times=3)
        yield run


@pytest.fixture
def url(run: Any) -> Iterator[str]:
    """Where the run is served."""
    command = [sys.executable, "-P", "-m", "busflow", "foxglove", "--port", "0"]
    environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": str(run.runtime), "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        found = re.search(r"ws://\S+", process.stdout.readline())
        assert found
        yield found[0]
        process.kill()


def test_published_message_reaches_every_process(run: Any, url: str):
    for number in range(1, 4):
        with connect(url, subprotocols=["foxglove.sdk.v1"], close_timeout=0.5) as viewer:
            channel = {"id": 1, "topic": "/numbers", "encoding": "json", "schemaName": "std_msgs/msg/Int64"}
            viewer.send(json.dumps({"op": "advertise", "channels": [channel]}))
            viewer.send(struct.pack("<BI", 1, 1) + json.dumps({"data": number}).encode())
            run.wait_for("received", f'"number": {number}', times=3)
