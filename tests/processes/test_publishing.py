"""What is published from outside is heard in all processes of a run, also a busy one, from the first message on."""

import pytest

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
    run = start(THREE, "--watchdog", "off")
    run.wait_for("listens", times=3)
    return run


def test_message_of_a_command_reaches_every_process(run):
    for number in range(1, 4):
        run.busflow("topic", "pub", "--once", "numbers", "std_msgs/msg/Int64", f"{{data: {number}}}")
        run.wait_for("received", f'"number": {number}', times=3)
