"""Every process of a run has the event loop that the run was asked to have, and does on it what it does on any."""

import pytest

from busflow.wire.client.client import join

pytestmark = pytest.mark.needs("uvloop")

PATIENCE_S = 60.0

FILE = """
processes:
  far:
nodes:
  teller: {plugin: teller, process: far, parameters: {at_start: 500}}
  hearer: {plugin: hearer, parameters: {tell_at: 500}, subscriptions: {numbers: {depth: 1000}}}
  looper: {plugin: looper}
  far_looper: {plugin: looper, process: far}
"""
LOOPER = """
import asyncio

from busflow import Node


class Looper(Node):
    async def start(self) -> None:
        self.log.info(f"runs on {type(asyncio.get_running_loop()).__base__.__module__}")
"""
SCRIPT = """
import sys

import busflow

sys.exit(busflow.run("run.yaml", event_loop="uvloop"))
"""


@pytest.mark.parametrize("script", [None, pytest.param("robot.py", marks=pytest.mark.long)], ids=["command", "script"])
def test_every_process_uses_the_event_loop(start, have_ended, monkeypatch, script):
    arguments = () if script else ("--event-loop", "uvloop", "-v", "--watchdog", "off")
    run = start(FILE, *arguments, files={"plugins/looper.py": LOOPER, "robot.py": SCRIPT}, script=script)
    run.wait_for("runs on uvloop", times=2)
    run.wait_for("heard enough")
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
    with join() as peer:
        assert peer.call(peer.service("/told"), {}, timeout_s=PATIENCE_S)["message"] == "500"
    pids = [*run.pids().values()]
    assert run.end() == 130
    assert have_ended(pids, 0)
    assert not any("did not stop in time" in line for line in run.lines)
