"""What a run must survive while others look into it, each in processes of its own."""

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
from busflow.timeouts import VARIABLE
from busflow.wire.client.client import Peer, join
from busflow.wire.zenoh.keys import TokenKind
from busflow.wire.zenoh.run_directory import find_run, runs

pytestmark = pytest.mark.e2e

PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""

NODES = Path(__file__).parents[1] / "nodes"
RUN, FLOOD, BLOCKED = NODES / "run_nodes.py", NODES / "flood.py", NODES / "blocked.py"
SLOW = f"""
plugins: [{NODES}]
nodes:
  timer: {{plugin: "slow:SlowTimer"}}
  handler: {{plugin: "slow:SlowHandler"}}
  task: {{plugin: "slow:SlowTask"}}
  run: {{plugin: "slow:SlowRun"}}
  source: {{plugin: "slow:Source"}}
  motor: {{plugin: "slow:Motor"}}
"""


class Program:
    """A program in a process of its own, which ends with the test."""

    def __init__(self, *command: str | Path, **words) -> None:
        self.process = subprocess.Popen(
            [sys.executable, *map(str, command)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            **words,
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

    def start(*command: str | Path, **words) -> Program:
        started.append(Program(*command, **words))
        return started[-1]

    yield start
    for each in started:
        each.kill()


@pytest.fixture
def flood(start):
    program = start(RUN, FLOOD, "flood")
    program.wait_for("ready")
    return program


def counts(peer, topic="counts"):
    return peer.graph().topic(topic).details["published"]


def subscribers(peer, topic):
    return [token for token in peer.tokens() if token.kind is TokenKind.SUBSCRIPTION and token.topic == topic]


def until(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, "it never came"
        threading.Event().wait(0.02)  # to ask without a pause would take a core, from who is asked too


def has_ended_balanced(flood: Program) -> None:
    code, log = flood.end()
    assert (code, "missed=0" in log) == (130, True), log


@pytest.mark.long
def test_stopped_and_killed_listener_harm_nothing(start, flood, runtime_folder):
    listener = start(NODES / "listen.py", "flood", "1000000", "/numbers", "/images")
    listener.wait_for("listening", "stdout")
    with join("flood") as peer:
        assert len(subscribers(peer, "/numbers")) == 1
        listener.process.send_signal(signal.SIGSTOP)
        before = counts(peer)
        until(lambda: counts(peer) > before + 2500)
        ((about),) = peer.ask("run")
        assert about["nodes"] == 2
        listener.kill()
        until(lambda: subscribers(peer, "/numbers") == [])
        before = counts(peer)
        until(lambda: counts(peer) > before)
    has_ended_balanced(flood)
    assert [path.name for path in runtime_folder.iterdir() if path.is_dir()] == []


@pytest.mark.long
def test_short_pause_loses_no_large_reliable_message(start):
    burst = start(RUN, NODES / "image_burst.py", "burst")
    burst.wait_for("ready")
    listener = start(NODES / "listen.py", "burst", "12", "/images")
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
def test_twenty_peers_at_once_are_all_answered(flood):
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
    has_ended_balanced(flood)


@pytest.mark.long
def test_blocked_run_is_listed_and_ends_at_interrupt(start, tmp_path):
    blocked = start(RUN, BLOCKED, "blocked", tmp_path / "blocked.mcap", env={**os.environ, VARIABLE: "grace=0.75"})
    blocked.wait_for("ready")
    with pytest.raises(InspectionUnavailable), join("blocked", patience_s=0.1) as hasty:
        hasty.ask("run")
    with join("blocked") as peer:
        assert "/blocks" in {token.node_name for token in peer.tokens()}
        code, log = blocked.end()
    assert code == 130
    assert "end within 0.85 s" in log, "a recording does not extend the grace"
    assert runs() == []  # whoever looks next removes what is left of it


@pytest.mark.long
def test_slow_nodes_do_not_prevent_other_stops(start, tmp_path):
    (tmp_path / "slow.yaml").write_text(SLOW)
    program = start("-m", "busflow", "run", "slow.yaml", cwd=tmp_path)
    for _ in range(2):
        program.wait_for("blocks the event loop")
    code, log = program.end()
    assert "the motor is off" in log
    assert "did not end" not in log
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
        program = start(RUN, FLOOD, "flood")
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
    "exits": 3,
    "never_stops": 0,
    "fails": 1,
    "is_refused": 1,
    "leaves_the_interpreter": 0,
    "stops_twice": 0,
    "fails_while_a_peer_publishes": 1,
}


@pytest.mark.long
def test_the_interpreter_ends_however_a_program_does(start):
    program = start(NODES / "program_ends.py", *ENDINGS)
    printed, log = program.process.communicate(timeout=PATIENCE_S)
    assert printed.splitlines() == [f"{ending} {code} []" for ending, code in ENDINGS.items()], log


def test_run_works_without_zenoh(start):
    program = start(NODES / "no_zenoh.py", FLOOD, "flood")
    program.wait_for("no wheel of zenoh")
    program.wait_for("ready")
    has_ended_balanced(program)
    assert runs() == []


@pytest.fixture
def talk(tmp_path: Path) -> Path:
    (tmp_path / "talk.yaml").write_text(f"name: talk\nplugins: [{NODES}]\nnodes: {{waiting: {{plugin: waiting}}}}\n")
    return tmp_path / "talk.yaml"


def test_closed_run_leaves_no_trace(start, talk):
    private = start("-m", "busflow", "run", talk, "--no-inspect")
    private.wait_for("ready")
    assert runs() == []
    maps = Path(f"/proc/{private.process.pid}/maps")
    if maps.exists():
        assert "zenoh" not in maps.read_text()
    assert private.end()[0] == 130


@pytest.mark.skipif(not Path("/proc/self/net/tcp").exists(), reason="needs Linux's /proc")
def test_run_listens_on_no_network(start, talk):
    program = start("-m", "busflow", "run", talk, umask=0)
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


@pytest.mark.long
def test_forked_processes_end_with_the_run(start):
    program = start(NODES / "forks.py", "fork", "busy", env={**os.environ, VARIABLE: "grace=0.75"})
    program.wait_for("ready found=[0, 2, 4]")
    code, said = program.end()  # it is at its end when nobody holds the standard error any more
    assert code == 130
    assert "did not end" in said


@pytest.mark.long
def test_a_node_may_use_other_processes(start):
    program = start(NODES / "forks.py", "forkserver", "waits")
    program.wait_for("ready found=[0, 2, 4]")
    with join("forks") as peer:
        assert peer.ask("run")[0]["nodes"] == 1
    code, said = program.end()
    assert (code, said.count("busflow: ")) == (130, 0), said  # it was ended by nobody else
    assert runs() == []
