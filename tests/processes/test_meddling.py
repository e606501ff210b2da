"""What code of a robot, a limit or a signal does to processes that exchange messages: the messages go on."""

import os
import signal

import pytest

PLACES = {"nothing": "main", "forks": "left", "leaves": "left", "closes": "right"}
READER = """\
  {deed}: {{plugin: "meddling:Meddler", process: {process}, parameters: {{deed: {deed}}}}}
"""
SOURCE = """
processes: {far: , left: , right: }
nodes:
  source: {plugin: "meddling:Source", process: far}
"""
MANY = """
processes: {far: }
nodes:
  talker: {plugin: "meddling:ManyTalker", process: far}
  listener: {plugin: "meddling:ManyListener"}
"""


def balances(run):
    for topic in run.report()["topics"]:
        for line in topic["subscriptions"]:
            assert line["published"] == line["delivered"] + line["dropped"] + line["queued"] > 0, line


@pytest.mark.long
def test_messages_go_on_whatever_a_node_does_to_its_process(start, have_ended):
    deeds = {deed: place for deed, place in PLACES.items() if deed != "leaves" or os.geteuid() == 0}
    run = start(SOURCE + "".join(READER.format(deed=deed, process=place) for deed, place in deeds.items()))
    run.wait_for_more("received", *deeds, times=1)
    pids = [run.process.pid, *run.pids().values()]
    for number in (signal.SIGSTOP, signal.SIGCONT):
        for pid in pids:
            os.kill(pid, number)
    run.wait_for_more("received", *deeds, times=2)
    assert run.end() == 130
    assert have_ended(pids[1:], 0)
    assert {line["node"] for line in run.log() if line["event"] == "gap"} <= {"/closes"}
    assert not [line for line in run.log() if line["level"] == "error"]
    balances(run)


def test_hundreds_of_topics_need_few_descriptors(start):
    run = start(MANY, prefix=["bash", "-c", 'ulimit -n 256; exec "$0" "$@"'])
    run.wait_for("has all")
    assert run.end() == 130
    assert not [line for line in run.log() if line["level"] in {"warning", "error"} and "longer_than" not in line]
    balances(run)
