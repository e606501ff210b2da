"""Machines of a run with other versions of busflow are named in the log, in words."""

import re

import pytest

import busflow
from busflow.clock import SystemClock
from busflow.launchfile.load.load import load
from busflow.log import Log
from busflow.processes.machines import Machines

FILE = """
machines: {arm: {connect: "tls/127.0.0.1:7447"}}
network: {ca: ca.pem}
nodes: {motor: {plugin: p, machine: arm}}
"""


@pytest.fixture
def seen(tmp_path):
    """The machines of a run as its main one sees them, and what it logs."""
    (tmp_path / "run.yaml").write_text(FILE)
    lines = []
    log = Log(SystemClock(), sinks=(lambda record: lines.append((record.level, record.event)),))
    return Machines(load(tmp_path / "run.yaml").network, "main", log.bind("busflow"), lambda: 0.0), lines


def test_other_minor_version_is_an_error_once(seen, golden):
    machines, lines = seen
    for process in ("arm:main", "arm:main", "arm:side", "main", "unknown:main"):
        machines.on_version(process, "99.1.0\x1b")
    ((level, text),) = lines
    assert level == "error"
    golden(text, mask={re.escape(busflow.__version__): "OWN VERSION"})
    assert machines.about()["machines"]["arm"]["version"] == "99.1.0\x1b"


def test_version_that_works_together_is_silent(seen):
    machines, lines = seen
    machines.on_version("arm:main", busflow.__version__ + ".post1")
    assert lines == []
