"""Tests of `play.py`, `play_alone.py`, `play_into.py`, `recover.py` and `signal_handling.py`."""

import json
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

LISTEN = """\
name: listen
plugins: [plugins]
nodes:
  listener:
    plugin: listener
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
def test_playing_ends_with_the_message_count(capsys, bag):
    assert main(["bag", "play", bag, "--rate", "20"]) == 0
    assert capsys.readouterr().out == f"{bag}: 100 messages played\n"
    assert main(["bag", "play", bag, "--rate", "20", "--start", "500ms", "--duration", "100ms", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["played"], answer["complete"]) == (11, True)


@pytest.mark.usefixtures("place")
def test_topics_that_are_not_played_are_named(capsys, tmp_path):
    path = write(tmp_path / "ticks.mcap", [("/n", Int64(data=1), 1), ("/_ticks", Int64(data=2), 2)])
    assert main(["bag", "play", path]) == 0
    assert main(["bag", "play", path, "--topics", "/n"]) == 0
    played = f"{path}: 1 message played"
    assert capsys.readouterr().out.splitlines() == [f"{played}, without the hidden /_ticks", played]


@pytest.mark.usefixtures("place")
def test_incomplete_recording_is_played_as_far_as_possible(capsys, tmp_path):
    path = write(tmp_path / "cut.mcap", [("/n", Int64(data=n), n) for n in range(1000)], finish=False)
    assert main(["bag", "play", path]) == 5
    output = capsys.readouterr()
    assert output.out == f"{path}: 1000 messages played, and it is INCOMPLETE\n"
    assert "the recording is not the whole of what happened" in output.err


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
    ("arguments", "why"),
    [
        (["--start", "5s", "--end", "2s"], "--end 2s is not after --start 5s: there is nothing between"),
        (["--start", "5s"], "--start 5s is beyond the end: "),
        (["--remap", "numbers"], "'numbers' is not of the form /old:=/new"),
        (["--remap", "/numbers:=/a b"], "a b"),
        (["--rate", "0"], "0.0 is not in the range"),
        (["--clock", "x"], "'x' is not a rate"),
        (["--clock=0"], "0 Hz is not above 0"),
        (["--duration", "x"], "a duration is"),
    ],
)
def test_invalid_arguments_are_refused_before_playing(capsys, bag, arguments, why):
    assert main(["bag", "play", bag, *arguments]) == 2
    assert why in capsys.readouterr().err


@pytest.mark.usefixtures("place")
@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["--topics", "nmbers"], "error: there is nothing on nmbers; did you mean '/numbers'"),
        (["--exclude", "/x"], "error: there is nothing on /x"),
        (
            ["--remap", "nmbers:=/x"],
            "error: the remap of /nmbers matches no topic that is played; did you mean '/numbers'",
        ),
        (["--run", "nobody"], "nothing is running"),
    ],
)
def test_missing_targets_are_refused_before_playing(capsys, bag, arguments, why):
    assert main(["bag", "play", bag, *arguments]) == 4
    assert why in capsys.readouterr().err


@pytest.mark.usefixtures("place")
def test_a_file_that_is_none(capsys, tmp_path):
    assert main(["bag", "play", "nothing.mcap"]) == 2
    assert "nothing.mcap: it cannot be opened" in capsys.readouterr().err
    (tmp_path / "text.mcap").write_text("hello")
    assert main(["bag", "play", str(tmp_path / "text.mcap")]) == 2


# Into another run.


@pytest.fixture
def listen(project):
    """A project whose listener logs when it is ready."""
    plugin = project / "plugins/listener.py"
    ready = "    async def start(self) -> None:\n        self.log.info('ready')\n\n    @subscription"
    plugin.write_text(plugin.read_text().replace("    @subscription", ready))
    (project / "listen.yaml").write_text(LISTEN)
    return project


def test_into_a_run_that_is_there(capsys, bag, listen, start_run):
    run = start_run(listen, "listen.yaml")
    run.wait_for("ready")
    assert main(["bag", "play", bag, "--run", "listen", "--rate", "5"]) == 0
    assert capsys.readouterr().out == f"{bag}: 100 messages played\n"
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
def test_foreign_topics_are_left_out_of_playing(capsys, tmp_path):
    path = write_bytes(
        tmp_path / "foreign.mcap",
        [
            ("/outside", "cdr", "std_msgs/msg/Float64", b"float64 data\n", {1: bytes([0, 1, *[0] * 10])}),
            ("/foreign", "protobuf", "", b"", {2: b"abc"}),
            ("/no_type", "json", "", b"", {3: b"{}"}),
        ],
    )
    for run in ([], ["--run", "imu_lab"]):
        assert main(["bag", "play", path, *run]) == 0
        out, err = capsys.readouterr()
        assert out == f"{path}: 1 message played\n"
        assert "/foreign, without a type, is encoded as 'protobuf'; cdr and json are read" in err
        assert "/no_type has no type, and a publisher needs one" in err
        assert main(["bag", "play", path, *run, "--topics", "/foreign"]) == 2
        assert "/foreign, without a type, is encoded as 'protobuf'" in capsys.readouterr().err


@pytest.mark.usefixtures("lab")
def test_a_topic_of_another_type_there_is_refused(capsys, tmp_path):
    path = write(tmp_path / "wrong.mcap", [("/imu/data", Int64(data=1), 0)])
    assert main(["bag", "play", path, "--run", "imu_lab", "--remap", "imu/dta:=others"]) == 4
    assert main(["bag", "play", path, "--run", "imu_lab"]) == 2
    assert "/imu/data has the type sensor_msgs/msg/Imu in the run, and was recorded as" in capsys.readouterr().err
    assert main(["bag", "play", path, "--run", "imu_lab", "--remap", "imu/data:=others"]) == 0


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


def test_readable_messages_are_recovered(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    numbers = write_numbers(tmp_path / "numbers.mcap", 500)
    content = numbers.read_bytes()
    numbers.write_bytes(content[: len(content) // 2])
    assert main(["bag", "recover", numbers.name]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("numbers.recovered.mcap: 2")
    assert said.out.endswith(" messages saved (attachments: 0, metadata: 0)\n")
    assert said.err.startswith("warning: numbers.mcap: at byte ")
    assert main(["bag", "recover", numbers.name]) == 2
    assert "it exists already; name another one, or take" in capsys.readouterr().err
    assert main(["bag", "recover", numbers.name, "-o", "b.mcap", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
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
