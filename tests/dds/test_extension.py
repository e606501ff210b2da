"""The tests of `extension` and `process`: a bridge that lives as long as its run, or does not open."""

import os
import select
import signal
from pathlib import Path

import pytest

from busflow.programs.keeper import descendants
from tests.dds.conftest import ROBOT

RUN = f"""{ROBOT}
import asyncio, signal, sys
from busflow.dds.extension import Bridge
from busflow.launchfile.model.ros2 import Ros2Spec

async def main():
    graph = busflow.launch(Driver, inspect="robot")
    graph.attach(Bridge(graph, Ros2Spec(int(sys.argv[1]), topics=("/speed",))))
    interrupted = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGINT, interrupted.set)
    async with graph:
        await interrupted.wait()

asyncio.run(main())
"""


def bridge_of(process):
    """The process number of a run's bridge."""
    found = [pid for pid in descendants(process.pid) if b"busflow.dds" in Path(f"/proc/{pid}/cmdline").read_bytes()]
    assert len(found) == 1
    return found[0]


@pytest.fixture
def attached(stage_of):
    """A run with a bridge of its own, from which a peer has received something."""
    stage = stage_of("-c", RUN, "DOMAIN")
    stage.robot.wait_for("see each other")
    peer = stage.peer()
    peer.do("read", topic="rt/speed", kind="Float64")
    peer.said(got="rt/speed", value=1.5)
    return stage, peer


def test_run_shows_only_what_may_cross(attached):
    _, peer = attached
    found = [line for line in peer.lines if '"found"' in line and "ros_discovery_info" not in line]
    assert found
    assert all("rt/speed" in line for line in found)


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="processes are found where Linux lists them")
def test_bridge_that_is_killed_opens_again(attached):
    stage, peer = attached
    os.kill(bridge_of(stage.robot.process), signal.SIGKILL)
    stage.robot.wait_for("the program dds was ended by SIGKILL")
    after = peer.mark()
    peer.said(found="writer", topic="rt/speed", after=after)
    peer.said(got="rt/speed", value=1.5, after=peer.mark())


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="processes are found where Linux lists them")
def test_bridge_ends_with_a_killed_run(attached):
    stage, _ = attached
    bridge = os.pidfd_open(bridge_of(stage.robot.process))
    stage.robot.end(signal.SIGKILL)
    assert select.select([bridge], [], [], 30)[0]
    os.close(bridge)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--interface", "<a>"], "no network interface is called '<a>'; there are"),
        (["--topics", "a b"], "a b"),
    ],
)
def test_bad_option_is_one_error(stage, options, text):
    printed = stage.busflow("dds", "--domain", str(stage.domain), *options)
    assert printed.startswith("error: ")
    assert text in printed
    assert "Traceback" not in printed


def test_missing_library_is_said(monkeypatch):
    from busflow.dds import process
    from busflow.errors import InspectionUnavailable

    monkeypatch.setattr(process, "find_spec", lambda _: None)
    with pytest.raises(InspectionUnavailable, match=r"busflow\[dds\]|\.\[dds\]"):
        process.require_cyclonedds()
