"""Tests of `play.py`, `play_alone.py`, `play_into.py`, `recover.py` and `signal_handling.py`."""

import os
import signal
import subprocess
import sys

import pytest
from mcap.writer import CompressionType, Writer

from busflow.cli import main
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import Float64, Int64
from busflow.recording.tools.convert import JsonlFile
from busflow.wire.client.client import Peer
from busflow.wire.client.speaker import Speaker
from tests.recording.conftest import write_numbers

MS = 1_000_000
TIME = {r"(?m)^\d\d:\d\d:\d\d\.\d+": "TIME"}

LISTEN = """\
name: listen
plugins: [plugins]
nodes:
  listener:
    plugin: listener
    subscriptions: {numbers: {depth: 100}}
"""


def write(path, messages, *, finish=True):
    """Write a recording of (topic, message, time in ns)."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=4096, compression=CompressionType.NONE)
        writer.start("ros2", "a test")
        channels = {}
        for topic, message, time_ns in messages:
            support = TypeSupport(type(message))
            if topic not in channels:
                schema = writer.register_schema(support.name, "ros2msg", support.definition.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], time_ns, support.encode(message), time_ns)
        if finish:
            writer.finish()
        else:
            writer.flush()
    return str(path)


def write_bytes(path, channels):
    """Write a recording of channels (topic, encoding, type, definition, messages as bytes by time in ns)."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("", "a test")
        for topic, encoding, type_name, definition, messages in channels:
            schema = writer.register_schema(type_name, "ros2msg", definition) if type_name else 0
            channel = writer.register_channel(topic, encoding, schema)
            for time_ns, payload in messages.items():
                writer.add_message(channel, time_ns, payload, time_ns)
        writer.finish()
    return str(path)


@pytest.fixture
def bag(tmp_path):
    return write(tmp_path / "talk.mcap", [("/numbers", Float64(data=float(n)), n * 10 * MS) for n in range(100)])


class Played:
    """`busflow bag play` in a process of its own."""

    def __init__(self, place, *arguments, **streams):
        command = [sys.executable, "-m", "busflow", "bag", "play", *arguments]
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | streams
        self.process = subprocess.Popen(command, env=place.environment, **streams)

    def end(self):
        self.process.send_signal(signal.SIGINT)
        out, err = self.process.communicate(timeout=60)
        return self.process.returncode, out.decode(), err.decode()


@pytest.fixture
def played(place):
    started = []

    def start(*arguments, **streams):
        started.append(Played(place, *arguments, **streams))
        return started[-1]

    yield start
    for each in started:
        if each.process.poll() is None:
            each.process.kill()
        each.process.wait()
        for stream in (each.process.stdout, each.process.stderr):
            if stream is not None:
                stream.close()


# In a run of its own.


@pytest.mark.usefixtures("place")
def test_playing_ends_with_the_message_count(shell, bag, tmp_path):
    assert shell(f"bag play {bag} --rate 20", mask=TIME) == 0
    answer = shell.data(f"bag play {bag} --rate 20 --start 500ms --duration 100ms")
    assert (answer["played"], answer["complete"]) == (11, True)
    ticks = write(tmp_path / "ticks.mcap", [("/n", Int64(data=1), 1), ("/_ticks", Int64(data=2), 2)])
    assert shell(f"bag play {ticks}", mask=TIME) == 0, "topics that are not played are named"
    assert shell(f"bag play {ticks} --topics /n", mask=TIME) == 0
    cut = write(tmp_path / "cut.mcap", [("/n", Int64(data=n), n) for n in range(1000)], finish=False)
    assert shell(f"bag play {cut}", mask=TIME) == 5


@pytest.mark.long
def test_other_commands_look_into_playing(capsys, bag, place, played):
    played(bag, "--loop", "--clock", "100")
    wait_for_run(place, "talk")
    assert main(["topic", "echo", "numbers", "--once"]) == 0
    assert capsys.readouterr().out.startswith("data: ")
    assert main(["topic", "echo", "clock", "--once"]) == 0
    assert "sec: 0" in capsys.readouterr().out
    assert main(["param", "set", "player", "paused", "true"]) == 0
    assert main(["service", "call", "/player/play_next", "std_srvs/srv/Trigger"]) == 0


@pytest.mark.long
def test_unknown_type_can_be_read_by_others(capsys, place, played, tmp_path):
    things = dict.fromkeys(range(0, 500 * MS, 10 * MS), b"\0\1\0\0\3\0\0\0\2\0\0\0x\0")
    thing = ("/thing", "cdr", "my_pkg/msg/Thing", b"int32 a\nstring b\n", things)
    played(write_bytes(tmp_path / "things.mcap", [thing]), "--loop")
    wait_for_run(place, "things")
    assert main(["topic", "echo", "thing", "--once"]) == 0
    assert capsys.readouterr().out == "a: 3\nb: x\n---\n"


@pytest.mark.long
def test_ctrl_c_ends_it_at_once(bag, place, played):
    player = played(bag, "--loop", "--rate", "0.001")
    wait_for_run(place, "talk")
    code, out, err = player.end()
    assert code == 130
    assert " played" in out
    assert "Traceback" not in err


def wait_for_run(place, name):
    """Wait until other processes find the run and its topics."""
    for _ in range(200):
        found = subprocess.run(
            [sys.executable, "-m", "busflow", "topic", "list", "--run", name],
            env=place.environment,
            capture_output=True,
            text=True,
        )
        if found.returncode == 0 and "/" in found.stdout.replace("/rosout", "").replace("/parameter_events", ""):
            return
    raise AssertionError(found.stderr)


@pytest.mark.usefixtures("place")
@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("--start 5s --end 2s", 2),
        ("--start 5s", 2),
        ("--remap numbers", 2),
        ("--remap '/numbers:=/a b'", 2),
        ("--rate 0", 2),
        ("--clock x", 2),
        ("--clock=0", 2),
        ("--duration x", 2),
        ("--topics nmbers", 4),
        ("--exclude /x", 4),
        ("--remap nmbers:=/x", 4),
        ("--run nobody", 4),
    ],
)
def test_mistake_is_reported_before_playing(shell, bag, line, code):
    assert shell(f"bag play {bag} {line}") == code


@pytest.mark.usefixtures("place")
def test_a_file_that_is_no_recording(shell, tmp_path):
    (tmp_path / "text.mcap").write_text("hello")
    for name in ("nothing.mcap", "text.mcap"):
        assert shell(f"bag play {tmp_path / name}") == 2


# Into another run.


@pytest.fixture
def listen(project):
    """A project whose listener logs when it is ready."""
    plugin = project / "plugins/listener.py"
    ready = "    async def start(self) -> None:\n        self.log.info('ready')\n\n    @subscription"
    plugin.write_text(plugin.read_text().replace("    @subscription", ready))
    (project / "listen.yaml").write_text(LISTEN)
    return project


def test_into_a_run_that_is_there(shell, bag, listen, start_run):
    run = start_run(listen, "listen.yaml")
    run.wait_for("ready")
    assert shell(f"bag play {bag} --run listen --rate 5") == 0
    run.wait_for("number=99.0")
    assert sum("heard" in line for line in run.lines) == 100


@pytest.mark.usefixtures("lab")
def test_playing_ends_when_all_has_arrived(tmp_path, monkeypatch):
    calls = []

    def note(cls, name):
        method = getattr(cls, name)
        monkeypatch.setattr(cls, name, lambda *arguments: (calls.append(name), method(*arguments)))

    note(Peer, "settle")  # without it, large messages are lost on a busy machine, some of the time
    note(Speaker, "publish_bytes")
    path = write(tmp_path / "one.mcap", [("/outside", Int64(data=1), 0)])
    assert main(["bag", "play", path, "--run", "imu_lab"]) == 0
    assert calls == ["settle", "publish_bytes", "settle"]


@pytest.mark.usefixtures("lab")
def test_foreign_topics_are_left_out_of_playing(shell, tmp_path):
    path = write_bytes(
        tmp_path / "foreign.mcap",
        [
            ("/outside", "cdr", "std_msgs/msg/Float64", b"float64 data\n", {1: bytes([0, 1, *[0] * 10])}),
            ("/foreign", "protobuf", "", b"", {2: b"abc"}),
            ("/no_type", "json", "", b"", {3: b"{}"}),
        ],
    )
    for run in ("", " --run imu_lab"):
        assert shell(f"bag play {path}{run}", mask=TIME) == 0
        assert shell(f"bag play {path}{run} --topics /foreign") == 2


@pytest.mark.usefixtures("lab")
def test_a_topic_of_another_type_there_is_refused(shell, tmp_path):
    path = write(tmp_path / "wrong.mcap", [("/imu/data", Int64(data=1), 0)])
    assert shell(f"bag play {path} --run imu_lab --remap imu/dta:=others") == 4
    assert shell(f"bag play {path} --run imu_lab") == 2
    assert shell(f"bag play {path} --run imu_lab --remap imu/data:=others") == 0


def test_a_run_follows_the_clock_of_a_recording(tmp_path, project, start_run):
    (project / "plugins/ticker.py").write_text(
        "from busflow import Node, timer\n\n\nclass Ticker(Node):\n"
        "    async def start(self) -> None:\n        self.log.info('ready')\n\n"
        "    @timer(1)\n    def tick(self) -> None:\n"
        "        self.log.info('tick', at=self.clock.now().nanoseconds)\n"
        "        if self.clock.now().sec >= 1003:\n            self.log.info('enough')\n"
    )
    (project / "follow.yaml").write_text(
        "name: follow\nplugins: [plugins]\nclock: {mode: follow}\nnodes:\n  ticker: {plugin: ticker}\n"
    )
    run = start_run(project, "follow.yaml")
    run.wait_for("ready")
    start_ns = 1_000_000_000_000
    path = write(tmp_path / "run.mcap", [("/n", Int64(data=n), start_ns + n * 100 * MS) for n in range(100)])
    assert main(["bag", "play", path, "--run", "follow", "--clock", "200", "--rate", "10"]) == 0
    run.wait_for("enough")
    ticks = [int(line.rpartition("at=")[2]) for line in run.lines if "tick " in line]
    assert ticks == sorted({*ticks})
    # The first second begins with the first stamp that arrives; on a busy machine a tick is late, or left out.
    assert start_ns + 1000 * MS <= ticks[0] <= ticks[-1] < start_ns + 10_000 * MS


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="there are no pseudo-terminals here")
def test_space_key_resumes_playing(bag, played):
    terminal, inside = os.openpty()
    player = played(bag, "--start-paused", "--rate", "50", stdin=inside, stderr=inside, stdout=inside)
    os.close(inside)
    seen = b""
    while b"paused" not in seen:
        seen += os.read(terminal, 4096)
    os.write(terminal, b"s ")
    while b"100 messages played" not in seen:
        seen += os.read(terminal, 4096)
    assert player.process.wait(timeout=60) == 0
    assert b"x50" in seen
    os.close(terminal)


# Other commands.


def test_readable_messages_are_recovered(tmp_path, monkeypatch, shell):
    monkeypatch.chdir(tmp_path)
    numbers = write_numbers(tmp_path / "numbers.mcap", 500)
    content = numbers.read_bytes()
    numbers.write_bytes(content[: len(content) // 2])
    counts = {r"at byte .*": "at byte #", r"\b2\d+ messages": "2… messages"}
    assert shell("bag recover numbers.mcap", mask=counts) == 0
    assert shell("bag recover numbers.mcap") == 2
    answer = shell.data("bag recover numbers.mcap -o b.mcap")
    assert (answer["version"], answer["output"], answer["missing"]) == (1, "b.mcap", None)
    assert main(["bag", "verify", "b.mcap"]) == 5


@pytest.mark.parametrize(("number", "code"), [(signal.SIGHUP, 129), (signal.SIGTERM, 143)])
def test_hangup_leaves_no_partial_output(tmp_path, monkeypatch, number, code):
    monkeypatch.chdir(tmp_path)
    write_numbers(tmp_path / "numbers.mcap", 10)
    monkeypatch.setattr(JsonlFile, "write", lambda _self, _entry: signal.raise_signal(number))
    before = signal.getsignal(number)
    with pytest.raises(SystemExit) as ended:
        main(["bag", "convert", "numbers.mcap", "out.jsonl", "--to", "jsonl"])
    assert ended.value.code == code
    assert [each.name for each in tmp_path.iterdir()] == ["numbers.mcap"]
    assert signal.getsignal(number) is before
