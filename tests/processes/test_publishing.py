"""What is published from outside is heard in all processes of a run, also a busy one, from the first message on."""

import os
import subprocess
import sys
from contextlib import ExitStack

import pytest

PATIENCE_S = 60.0

LISTENER = """
import threading

from busflow import Node, Parameters, subscription, timer
from busflow.msgs.std_msgs import Int64


class ListenerParameters(Parameters):
    busy_s: float = 0.0


class Listener(Node):
    parameters: ListenerParameters

    async def start(self) -> None:
        self.log.info("listens")

    @timer(0.01)
    def be_busy(self) -> None:
        threading.Event().wait(self.parameters.busy_s)  # in which nothing else is done in its process

    @subscription("numbers")
    def hear(self, number: Int64) -> None:
        self.log.info("heard", number=number.data)
"""

THREE = """
processes: {near: , far: }
nodes:
  one: {plugin: listener}
  two: {plugin: listener, process: near}
  three: {plugin: listener, process: far, parameters: {busy_s: 0.1}}
"""


@pytest.fixture
def run(start):
    """Three processes that receive a topic; one of them has no time for it but every 0.1 s."""
    run = start(THREE, "--watchdog", "off", files={"plugins/listener.py": LISTENER})
    run.wait_for("listens", times=3)
    return run


@pytest.fixture
def beside(run):
    """Starts commands in another terminal."""
    environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": str(run.runtime), "PYTHONUNBUFFERED": "1"}
    with ExitStack() as started:

        def start(*arguments):
            command = [sys.executable, "-m", "busflow", *arguments]
            process = started.enter_context(
                subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
            )
            started.callback(process.kill)
            return process

        yield start


def test_message_of_a_command_reaches_every_process(run, beside):
    for number in range(1, 4):
        message = ("numbers", "std_msgs/msg/Int64", f"{{data: {number}}}")
        assert beside("topic", "pub", "--once", *message).wait(PATIENCE_S) == 0
        run.wait_for("heard", f'"number": {number}', times=3)
