"""What a run publishes and answers last reaches those that wait for it, although the run's session closes."""

import signal
from collections.abc import Callable, Iterator
from contextlib import closing

import pytest

from busflow.wire.client.client import Peer
from busflow.wire.zenoh.run_directory import find_run
from tests.wire.conftest import Robot

PATIENCE_S = 60.0


@pytest.fixture
def robot(robots: Callable[..., Robot]) -> Robot:
    # How long Zenoh needs to send what it has accepted is known to nobody: the run waits here until the test ends it.
    return robots("last_words.py", overtaken="inf").ready()


@pytest.fixture
def peer(robot: Robot) -> Iterator[Peer]:
    with closing(Peer(find_run(robot.name))) as peer:
        yield peer


def test_large_messages_of_a_nodes_end_arrive(robot: Robot, peer: Peer):
    with peer.listen(peer.graph().topic("images")) as listener:
        peer.ask("log", count=1, node=None, level=0)  # answered once the run knows that somebody listens
        robot.signal(signal.SIGINT)
        assert [listener.get(PATIENCE_S).sequence for _ in range(5)] == [1, 2, 3, 4, 5]


def test_a_large_answer_arrives_though_the_run_ends(peer: Peer):
    answer = peer.call(peer.service("/close"), {}, timeout_s=PATIENCE_S)
    assert len(answer["message"]) == 30_000_000
