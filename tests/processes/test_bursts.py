"""Bursts of small messages between the processes of a run, while a reader stops and one is killed."""

import signal

import pytest

RUN = """
processes: {left: {restart: on-failure}, other: {restart: never}}
nodes:
  source: {plugin: "images:BurstSource", process: left}
  here: {plugin: "images:OrderedReader"}
  beside: {plugin: "images:OrderedReader", process: other}
"""


def received(run, *nodes, times=1):
    """Wait until each of these nodes has logged so often again that it has received 2,000 numbers."""
    run.wait_for_more("received", *nodes, times=times)


@pytest.mark.long
def test_accounts_hold_while_readers_stop_and_publishers_die(start):
    run = start(RUN, "-v")
    received(run, "here", "beside")
    run.kill("other", signal.SIGSTOP)
    try:
        received(run, "here", times=4)
    finally:
        run.kill("other", signal.SIGCONT)
    received(run, "beside")
    run.kill("left")
    run.wait_for("the process left is started", times=2)
    received(run, "here", "beside")
    assert run.end() == 130
    numbers = run.topic("/numbers")
    for line in numbers["subscriptions"]:
        assert line["published"] == line["delivered"] + line["dropped"] + line["queued"] > 0
        assert line["published"] >= numbers["published"] - numbers["losses"].get("lost", 0)
    here, beside = sorted(numbers["subscriptions"], key=lambda line: line["node"] != "/here")
    assert here["delivered"] > beside["delivered"], "what a stopped reader missed the other one got"
