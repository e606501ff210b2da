"""What a run publishes and answers last reaches those that wait for it, although the run's session closes."""

import signal
from collections.abc import Callable

import pytest

from busflow.wire.client.client import Peer
from busflow.wire.zenoh.run_directory import find_run
from tests.wire.conftest import Robot

PATIENCE_S = 60.0

CAMERA = """
class Camera(Node):
    images = publisher(Image, "images")

    async def run(self) -> None:
        size = 1_000_000
        self.last = Image(height=1, width=size, encoding="mono8", step=size, data=np.zeros(size, np.uint8))
        self.log.info("ready")
        await asyncio.Event().wait()

    async def stop(self) -> None:
        for _ in range(5):
            self.images.publish(self.last)
"""

LIBRARY = """
import signal

from busflow.msgs.std_srvs import Trigger


class Library(Node):
    @service(Trigger, "close")
    def close(self, request: Trigger.Request) -> Trigger.Response:
        os.kill(os.getpid(), signal.SIGINT)
        return Trigger.Response(success=True, message="x" * 30_000_000)

    async def run(self) -> None:
        self.log.info("ready")
"""


@pytest.fixture
def peer_of(robots: Callable[..., Robot]):
    """A function that starts a run and joins it."""
    peers = []

    def start(source: str) -> tuple[Robot, Peer]:
        robot = robots(source).ready()
        peers.append(Peer(find_run(robot.name)))
        return robot, peers[-1]

    yield start
    for each in peers:
        each.close()


def test_large_messages_of_a_nodes_end_arrive(peer_of):
    robot, peer = peer_of(CAMERA)
    with peer.listen(peer.graph().topic("images")) as listener:
        peer.ask("log", count=1, node=None, level=0)  # answered once the run knows that somebody listens
        robot.signal(signal.SIGINT)
        assert [listener.get(PATIENCE_S).sequence for _ in range(5)] == [1, 2, 3, 4, 5]


def test_a_large_answer_arrives_though_the_run_ends(peer_of):
    _, peer = peer_of(LIBRARY)
    answer = peer.call(peer.service("/close"), {}, timeout_s=PATIENCE_S)
    assert len(answer["message"]) == 30_000_000
