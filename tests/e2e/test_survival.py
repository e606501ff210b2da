"""What a run must survive while others look into it, each in processes of its own."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from busflow.errors import InspectionUnavailable, NoSuchRun
from busflow.wire.client.client import Peer, join
from busflow.wire.zenoh.keys import TokenKind
from busflow.wire.zenoh.run_directory import find_run, runs

pytestmark = pytest.mark.e2e

PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""

FLOOD = """
import sys, time
import numpy as np
import busflow
from busflow import Node, publisher, subscription, timer
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Float64MultiArray, Int64

NUMBERS = Float64MultiArray(data=[0.5] * 40)
IMAGE = Image(height=1080, width=1920, encoding="rgb8", step=5760, data=np.zeros(6_220_800, np.uint8))


class Flood(Node):
    numbers = publisher(Float64MultiArray, "numbers")
    images = publisher(Image, "images")
    counts = publisher(Int64, "counts")
    late = worst = ticks = 0

    async def run(self) -> None:
        self.log.info("ready")

    @timer(0.001, missed="burst")
    def tick(self) -> None:
        self.ticks += 1
        began = time.perf_counter()
        self.numbers.publish(NUMBERS)
        if self.ticks % 50 == 0:
            self.images.publish(IMAGE)
        self.worst = max(self.worst, time.perf_counter() - began)
        self.counts.publish(Int64(data=self.ticks))

    async def stop(self) -> None:
        self.log.info("flooded", ticks=self.ticks, worst_ms=round(self.worst * 1000, 3))


class Ear(Node):
    last = missed = 0

    @subscription("counts")
    def hear(self, count: Int64) -> None:
        self.missed += count.data - self.last - 1
        self.last = count.data

    async def stop(self) -> None:
        self.log.info("heard", missed=self.missed)


sys.exit(busflow.run(Flood, Ear, inspect="flood"))
"""

ECHO = """
import sys
from busflow.wire.client.client import join

with join(sys.argv[1]) as peer:
    topics = [peer.graph().topic(name) for name in sys.argv[2:]]
    with peer.listen(topics[0]) as first, peer.listen(topics[-1]) as second:
        first.get(60)
        print("listening", flush=True)
        while True:
            first.get(60)
"""

BURST = """
import sys
import numpy as np
import busflow
from busflow import Node, publisher, subscription
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Int64

IMAGE = Image(height=256, width=256, encoding="mono8", step=256, data=np.zeros(65_536, np.uint8))


class Burst(Node):
    images = publisher(Image, "images")

    async def run(self) -> None:
        self.log.info("ready")

    @subscription("go")
    def go(self, count: Int64) -> None:
        for _ in range(count.data):
            self.images.publish(IMAGE)


sys.exit(busflow.run(Burst, inspect="burst"))
"""

COUNT = """
import sys
from busflow.wire.client.client import join

with join("burst") as peer:
    topic = peer.graph().topic("/images")
    with peer.listen(topic) as images:
        images.get(60)
        print("listening", flush=True)
        for _ in range(int(sys.argv[1])):
            images.get(60)
        print("lost", images.lost, flush=True)
"""

BLOCKED = """
import sys, time
import busflow
from busflow import Node, timer


class Blocks(Node):
    @timer(0.05)
    def tick(self) -> None:
        self.log.info("ready")
        time.sleep(3600)


sys.exit(busflow.run(Blocks, inspect="blocked"))
"""


SLOW = """
import asyncio, time
from busflow import Node, QoS, publisher, subscription, timer
from busflow.msgs.std_msgs import Int64


class Source(Node):
    numbers = publisher(Int64, "numbers")

    @timer(0.05)
    def tick(self) -> None:
        for number in range(20):
            self.numbers.publish(Int64(data=number))


class Motor(Node):
    async def stop(self) -> None:
        await self.clock.sleep(0.01)
        self.log.info("the motor is off")


class SlowTimer(Node):
    @timer(0.05)
    def tick(self) -> None:
        time.sleep(1.0)


class SlowHandler(Node):
    @subscription("numbers", qos=QoS(depth=100))
    def hear(self, _number: Int64) -> None:
        time.sleep(0.3)


class SlowTask(Node):
    @subscription("numbers", qos=QoS(depth=100))
    async def hear(self, _number: Int64) -> None:
        time.sleep(0.3)


class SlowRun(Node):
    async def run(self) -> None:
        while True:
            time.sleep(1.0)
            await asyncio.sleep(0)
"""

SLOW_LAUNCH = """
shutdown: {grace: 20}
plugins: [.]
nodes:
  slow: {plugin: "slow:KIND"}
  source: {plugin: "slow:Source"}
  motor: {plugin: "slow:Motor"}
"""


class Program:
    """A program in a process of its own, which ends with the test."""

    def __init__(self, source: str, *arguments: str, **words) -> None:
        command = [sys.executable, "-c", source, *arguments]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True, **words
        )

    def wait_for(self, text: str, stream: str = "stderr") -> None:
        lines = []
        for line in getattr(self.process, stream):
            lines.append(line)
            if text in line:
                return
        raise AssertionError(f"{text!r} was never said: {''.join(lines)} {self.process.stderr.read()}")

    def end(self) -> tuple[int, str]:
        """Press Ctrl-C: the exit code, and the rest of the log."""
        self.process.send_signal(signal.SIGINT)
        rest = self.process.stderr.read()
        return self.process.wait(PATIENCE_S), rest

    def kill(self) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.communicate()


@pytest.fixture
def start():
    started = []

    def start(source: str, *arguments: str, **words) -> Program:
        started.append(Program(source, *arguments, **words))
        return started[-1]

    yield start
    for each in started:
        each.kill()


def counts(peer, topic="counts"):
    return peer.graph().topic(topic).details["published"]


def subscribers(peer, topic):
    return [token for token in peer.tokens() if token.kind is TokenKind.SUBSCRIPTION and token.topic == topic]


def until(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, "it never came"
        threading.Event().wait(0.02)  # to ask without a pause would take a core, from who is asked too


def is_balanced(log: str) -> bool:
    """Whether the node that counts its own messages has missed none."""
    return "missed=0" in log


@pytest.mark.long
def test_killed_listener_leaves_the_run_running(start, runtime_folder):
    flood = start(FLOOD)
    flood.wait_for("ready")
    listener = start(ECHO, "flood", "/numbers", "/images")
    listener.wait_for("listening", "stdout")
    with join("flood") as peer:
        assert len(subscribers(peer, "/numbers")) == 1
        listener.kill()
        until(lambda: subscribers(peer, "/numbers") == [])
        before = counts(peer)
        until(lambda: counts(peer) > before)
    code, log = flood.end()
    assert (code, is_balanced(log)) == (130, True), log
    assert [path.name for path in runtime_folder.iterdir() if path.is_dir()] == []


@pytest.mark.long
def test_a_stopped_listener_slows_nothing_down(start, runtime_folder):
    flood = start(FLOOD)
    flood.wait_for("ready")
    listener = start(ECHO, "flood", "/numbers", "/images")
    listener.wait_for("listening", "stdout")
    listener.process.send_signal(signal.SIGSTOP)
    with join("flood") as peer:
        before = counts(peer)
        until(lambda: counts(peer) > before + 2500)
        ((told),) = peer.ask("run")
        assert told["nodes"] == 2
    code, log = flood.end()
    assert (code, is_balanced(log)) == (130, True), log
    assert [path.name for path in runtime_folder.iterdir() if path.is_dir()] == []


@pytest.mark.long
def test_short_pause_loses_no_large_reliable_message(start):
    burst = start(BURST)
    burst.wait_for("ready")
    listener = start(COUNT, "12")
    with join("burst") as peer, peer.advertise("/go", peer.type("std_msgs/msg/Int64")) as go:
        until(lambda: subscribers(peer, "/images"))
        go.publish({"data": 1})
        listener.wait_for("listening", "stdout")
        listener.process.send_signal(signal.SIGSTOP)
        go.publish({"data": 12})
        until(lambda: counts(peer, "images") == 13)
        listener.process.send_signal(signal.SIGCONT)
        listener.wait_for("lost 0", "stdout")
    assert burst.end()[0] == 130


@pytest.mark.long
def test_twenty_peers_at_once_are_all_answered(start):
    flood = start(FLOOD)
    flood.wait_for("ready")
    told, run = [], find_run("flood")

    def look():
        peer = Peer(run, patience_s=PATIENCE_S)
        try:
            topic = peer.graph().topic("counts")
            with peer.listen(topic) as listener:
                first, second = (listener.get(PATIENCE_S) for _ in range(2))
            told.append(first.sequence < second.sequence)
        finally:
            peer.close()

    looking = [threading.Thread(target=look) for _ in range(20)]
    for each in looking:
        each.start()
    for each in looking:
        each.join(PATIENCE_S)
    assert told == [True] * 20
    code, log = flood.end()
    assert (code, is_balanced(log)) == (130, True), log


@pytest.mark.long
def test_restarted_run_keeps_its_name(start):
    first = start(FLOOD)
    first.wait_for("ready")
    with join("flood") as peer:
        topic = peer.graph().topic("counts")
        with peer.listen(topic) as listener:
            assert listener.get(PATIENCE_S)
            first.kill()
            until(lambda: listener.get(0.2) is None)
            with pytest.raises(NoSuchRun):
                find_run("flood")
            second = start(FLOOD)
            second.wait_for("ready")
            assert find_run("flood").card.pid == second.process.pid
            with join("flood") as other:
                assert counts(other) >= 0
    assert second.end()[0] == 130
    assert runs() == []


@pytest.mark.long
def test_blocked_run_is_listed_and_ends_at_interrupt(start):
    blocked = start(BLOCKED)
    blocked.wait_for("ready")
    with join("blocked", patience_s=0.5) as peer:
        with pytest.raises(InspectionUnavailable, match="blocks its event loop"):
            peer.ask("run")
        assert "/blocks" in {token.node_name for token in peer.tokens()}
        code, log = blocked.end()
    assert code == 130
    assert "the run did not end within" in log
    assert runs() == []  # whoever looks next removes what is left of it


@pytest.mark.long
def test_recording_does_not_extend_the_grace(start, tmp_path):
    recorded = BLOCKED.replace('inspect="blocked"', 'inspect="blocked", record=sys.argv[1]')
    assert recorded != BLOCKED
    blocked = start(recorded, str(tmp_path / "blocked.mcap"))
    blocked.wait_for("ready")
    code, log = blocked.end()
    assert code == 130
    assert "the run did not end within 0.85 s" in log


@pytest.mark.long
@pytest.mark.parametrize(
    "kind",
    ["SlowTimer", "SlowHandler", "SlowTask", "SlowRun"],
)
def test_slow_node_does_not_prevent_other_stops(start, tmp_path, kind):
    (tmp_path / "slow.py").write_text(SLOW)
    (tmp_path / "slow.yaml").write_text(SLOW_LAUNCH.replace("KIND", kind))
    run = "import sys; from busflow.cli import main; sys.argv = ['busflow', 'run', 'slow.yaml']; sys.exit(main())"
    program = start(run, cwd=tmp_path)
    for _ in range(2):
        program.wait_for("blocks the event loop")
    code, log = program.end()
    assert "the motor is off" in log
    assert "did not end within" not in log
    assert code == 130


@pytest.mark.long
def test_peers_are_answered_during_start_and_end(start):
    stop, odd = threading.Event(), []

    def look():
        while not stop.is_set():
            try:
                with join(patience_s=1.0) as peer:
                    peer.graph()
            except (InspectionUnavailable, NoSuchRun):
                pass
            except BaseException as error:
                odd.append(error)
                raise

    looking = [threading.Thread(target=look) for _ in range(3)]
    for each in looking:
        each.start()
    for _ in range(2):
        program = start(FLOOD)
        program.wait_for("ready")
        code, log = program.end()
        assert (code, "Traceback" in log) == (130, False), log
    stop.set()
    for each in looking:
        each.join(PATIENCE_S)
    assert odd == []
    assert runs() == []


# The interpreter ends, whatever happens.

ENDINGS = {
    "exits": ("async with busflow.launch(Talker, inspect='end') as graph: sys.exit(3)", 3),
    "never stopped": ("graph = busflow.launch(Talker, inspect='end'); await graph.start()", 0),
    "fails": ("async with busflow.launch(Fails, inspect='end') as graph: await graph.wait()", 1),
    "refused": ("await busflow.launch(Talker, Talker, inspect='end').start()", 1),
    "left in the air": ("graph = busflow.launch(Talker, inspect='end'); await graph.start(); os._exit(0)", 0),
    "twice": ("graph = busflow.launch(Talker, inspect='end')\n    async with graph: pass\n    await graph.stop()", 0),
    "heard": ("""async with busflow.launch(Talker, inspect='end') as graph:
        late = graph.subscribe(Int64, 'other')
        peer = await asyncio.to_thread(lambda: Peer(find_run('end')))
        type_ = await asyncio.to_thread(peer.type, 'std_msgs/msg/Int64')
        def speak():
            with peer.advertise('/other', type_) as speaker:
                speaker.publish({'data': 1})
        await asyncio.to_thread(speak)
        await anext(late)
        peer.close()
        raise ValueError('mine')""", 1),
}  # fmt: skip
PROGRAM = """
import asyncio, os, sys
import busflow
from busflow import Node, publisher
from busflow.msgs.std_msgs import Int64
from busflow.wire.client.client import Peer
from busflow.wire.zenoh.run_directory import find_run


class Talker(Node):
    numbers = publisher(Int64, "numbers")


class Fails(Node):
    async def run(self) -> None:
        raise ValueError("its own")


async def main():
    BODY


asyncio.run(main())
"""


@pytest.mark.long
@pytest.mark.parametrize("ending", ENDINGS)
def test_the_interpreter_ends_however_a_program_does(start, ending):
    body, code = ENDINGS[ending]
    program = start(PROGRAM.replace("BODY", body))
    _, log = program.process.communicate(timeout=PATIENCE_S)
    assert program.process.returncode == code, log
    assert runs() == []


# What is off is said.

WITHOUT_ZENOH = """
import sys
from importlib.abc import MetaPathFinder


class Missing(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "zenoh":
            raise ImportError("no wheel of zenoh for this platform")
        return None


sys.meta_path.insert(0, Missing())
"""


def test_run_works_without_zenoh(start):
    program = start(WITHOUT_ZENOH + FLOOD)
    program.wait_for("this run cannot be inspected: Zenoh cannot be imported here (no wheel of zenoh")
    program.wait_for("ready")
    code, log = program.end()
    assert (code, is_balanced(log)) == (130, True), log
    assert runs() == []


@pytest.fixture
def talk(tmp_path: Path) -> Path:
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins/talker.py").write_text(
        "import asyncio\n\nfrom busflow import Node\n\n\nclass Talker(Node):\n    async def run(self) -> None:\n"
        '        self.log.info("ready")\n        await asyncio.Event().wait()\n'
    )
    (tmp_path / "talk.yaml").write_text("name: talk\nplugins: [plugins]\nnodes:\n  talker:\n    plugin: talker\n")
    return tmp_path / "talk.yaml"


COMMAND = "import sys; from busflow.cli import main; sys.exit(main())"


def test_closed_run_leaves_no_trace(start, talk):
    private = start(COMMAND, "run", str(talk), "--no-inspect")
    private.wait_for("ready")
    assert runs() == []
    maps = Path(f"/proc/{private.process.pid}/maps")
    if maps.exists():
        assert "zenoh" not in maps.read_text()
    assert private.end()[0] == 130


# Nobody beyond this machine, and nobody else on it.


@pytest.mark.skipif(not Path("/proc/self/net/tcp").exists(), reason="needs Linux's /proc")
@pytest.mark.parametrize("umask", [0, pytest.param(0o077, marks=pytest.mark.long)])
def test_run_listens_on_no_network(start, talk, umask):
    program = start(COMMAND, "run", str(talk), umask=umask)
    program.wait_for("ready")
    inodes = {
        link.removeprefix("socket:[").removesuffix("]")
        for fd in Path(f"/proc/{program.process.pid}/fd").iterdir()
        if (link := str(fd.readlink())).startswith("socket:[")
    }
    network = set()
    for table in ("tcp", "tcp6", "udp", "udp6", "raw", "raw6"):
        rows = Path(f"/proc/{program.process.pid}/net/{table}")
        network |= {row.split()[9] for row in rows.read_text().splitlines()[1:]} if rows.exists() else set()
    assert inodes
    assert inodes & network == set()
    directory = find_run("talk").directory
    assert [path.stat().st_mode & 0o777 for path in (directory, directory.parent)] == [0o700, 0o700]
    assert program.end()[0] == 130


FORKS = """
import asyncio, multiprocessing, os, sys
import busflow
from busflow import Node


def work(number):
    return number * 2


class Forks(Node):
    async def run(self) -> None:
        with multiprocessing.get_context(sys.argv[1]).Pool(2) as pool:
            found = await self.run_sync(pool.map, work, range(3))
            self.log.info(f"ready {found}")
            await asyncio.Event().wait()


if __name__ == "__main__":
    sys.exit(busflow.run(Forks, inspect="forks"))
"""


BUSY = "[pool.apply_async(any, (iter(int, 1),)), any(() for _ in iter(int, 1))]"
"""One of the other processes has work for ever, and the node has, too."""


@pytest.mark.long
def test_forked_processes_end_with_the_run(start, tmp_path):
    (tmp_path / "forks.py").write_text(FORKS.replace("await asyncio.Event().wait()", BUSY))
    execute = "import os, sys; os.execv(sys.executable, [sys.executable, sys.argv[2], sys.argv[1]])"
    program = start(execute, "fork", str(tmp_path / "forks.py"))
    program.wait_for("ready [0, 2, 4]")
    code, said = program.end()  # it is at its end when nobody holds the standard error any more
    assert code == 130
    assert "did not end within" in said


@pytest.mark.long
@pytest.mark.parametrize("method", ["fork", "forkserver"])
def test_a_node_may_use_other_processes(start, tmp_path, method):
    (tmp_path / "forks.py").write_text(FORKS)
    execute = "import os, sys; os.execv(sys.executable, [sys.executable, sys.argv[2], sys.argv[1]])"
    program = start(execute, method, str(tmp_path / "forks.py"))
    program.wait_for("ready [0, 2, 4]")
    with join("forks") as peer:
        assert json.dumps(peer.ask("run")[0]["nodes"]) == "1"
    code, said = program.end()
    assert (code, said.count("busflow: ")) == (130, 0), said  # it was ended by nobody else
    assert runs() == []
