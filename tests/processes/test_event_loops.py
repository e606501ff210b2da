"""Every process of a run has the event loop that the run was asked to have, and does on it what it does on any."""

import pytest

from busflow.wire.client.client import join

pytestmark = pytest.mark.needs("uvloop")

PATIENCE_S = 60.0

FILE = """
processes:
  far:
nodes:
  source: {plugin: source, process: far, parameters: {at_start: 500}}
  sink: {plugin: sink, parameters: {enough: 500}, subscriptions: {numbers: {depth: 1000}}}
  place: {plugin: "places:Place"}
  far_place: {plugin: "places:Place", process: far}
"""


def test_every_process_uses_the_event_loop(start, have_ended, monkeypatch):
    run = start(FILE, "--event-loop", "uvloop", "-v", "--watchdog", "off")
    run.wait_for('"loop": "uvloop', times=2)
    run.wait_for("received enough")
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
    with join() as peer:
        assert peer.call(peer.service("/count"), {}, timeout_s=PATIENCE_S)["message"] == "500"
    pids = [*run.pids().values()]
    assert run.end() == 130
    assert have_ended(pids, 0)
    assert not any("did not stop" in line for line in run.lines)
