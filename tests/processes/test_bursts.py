"""Bursts of small messages between the processes of a run, while a reader stops and one is killed."""

import signal

import pytest

TALK = """
from busflow import Node, QoS, publisher, subscription, timer
from busflow.msgs.std_msgs import Int64


class Talker(Node):
    numbers = publisher(Int64, "numbers")

    async def start(self) -> None:
        self.said = self.clock.now_ns() // 1000  # so that the next life goes on from higher numbers

    @timer(0.01)
    def say(self) -> None:
        for self.said in range(self.said + 1, self.said + 51):
            self.numbers.publish(Int64(data=self.said))


class Ear(Node):
    heard = 0
    last = 0

    @subscription("numbers", qos=QoS(depth=100))
    def hear(self, number: Int64) -> None:
        if number.data <= self.last:
            raise ValueError(f"{number.data} after {self.last}")
        self.last = number.data
        self.heard += 1
        if self.heard % 2000 == 0:
            self.log.info("heard", count=self.heard)
"""

RUN = """
processes: {mouth: {restart: on-failure}, other: {restart: never}}
nodes:
  talker: {plugin: "talk:Talker", process: mouth}
  here: {plugin: "talk:Ear"}
  beside: {plugin: "talk:Ear", process: other}
"""


def heard(run, *nodes, times=1):
    """Wait until each of these nodes has logged so often again that it has heard 2,000 numbers."""
    run.wait_for_more("heard", *nodes, times=times)


@pytest.mark.long
def test_accounts_hold_while_readers_stop_and_publishers_die(start):
    run = start(RUN, "-v", files={"plugins/talk.py": TALK})
    heard(run, "here", "beside")
    run.kill("other", signal.SIGSTOP)
    try:
        heard(run, "here", times=4)
    finally:
        run.kill("other", signal.SIGCONT)
    heard(run, "beside")
    run.kill("mouth")
    run.wait_for("the process mouth is started", times=2)
    heard(run, "here", "beside")
    assert run.end() == 130
    numbers = run.topic("/numbers")
    for line in numbers["subscriptions"]:
        assert line["published"] == line["delivered"] + line["dropped"] + line["queued"] > 0
        assert line["published"] >= numbers["published"] - numbers["losses"].get("lost", 0)
    here, beside = sorted(numbers["subscriptions"], key=lambda line: line["node"] != "/here")
    assert here["delivered"] > beside["delivered"], "what a stopped reader missed the other one got"
