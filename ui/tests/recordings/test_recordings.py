"""Recordings as pages see them, on a file of the project's lab.

Of `contents.py`, `overview.py`, `playback.py`, `recording.py` and `recording_page.py`.
"""

import asyncio
import json
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, serve

from busflow.errors import BagError, InvalidInput
from busflow.recording.bag import Bag
from busflow_ui.recordings.contents import graph_of, log_of
from busflow_ui.recordings.overview import Named, Stretch, overview, value_at
from busflow_ui.recordings.playback import Playback
from busflow_ui.recordings.recording import Recording, opened
from busflow_ui.recordings.recording_page import RecordingPage
from tests.golden import Golden

LAB = Path(__file__).parents[3] / "configs/lab1.yaml"
S = 1_000_000_000
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a minute of virtual time."""
    path = tmp_path_factory.mktemp("recording") / "lab.mcap"
    command = [sys.executable, "-m", "busflow", "run", str(LAB), "--sim", "--for", "1min", "--record", str(path)]
    subprocess.run(command, check=True, capture_output=True)
    return path


@pytest.fixture(scope="module")
def recording(file: Path) -> Iterator[Recording]:
    found = opened(file)
    yield found
    found.close()


# The moment.


def test_a_playback_moves_with_time_and_rate():
    still = Playback(10 * S, 20 * S, 12 * S)
    assert still.at(99 * S) == 12 * S
    playing = still.changed(100 * S, playing=True, rate=2.0)
    assert playing.at(102 * S) == 16 * S
    assert playing.at(500 * S) == 20 * S
    slower = playing.changed(102 * S, rate=0.5)
    assert slower.at(104 * S) == 17 * S
    assert slower.changed(104 * S, playing=False).at(900 * S) == 17 * S
    assert slower.changed(104 * S, stamp_ns=5 * S).at(104 * S) == 10 * S


def test_its_moments_are_text():
    found = Playback(1, 1795501648996846647, 5).as_json(0)
    assert found == {"start_ns": "1", "end_ns": "1795501648996846647", "stamp_ns": "5", "playing": False, "rate": 1.0}


# What a recording holds.


def test_hidden_topics_are_left_out(recording: Recording):
    topics = [each.channel.topic for each in recording.topics.values()]
    assert topics == [
        "/balance_state",
        "/imu/data",
        "/joint_states",
        "/parameter_events",
        "/rosout",
        "/stability_index",
    ]
    announced = recording.topics[2].announcement()
    assert (announced["topic"], announced["encoding"], announced["schemaEncoding"]) == ("/imu/data", "cdr", "ros2msg")
    assert "linear_acceleration" in announced["schema"]


def test_the_last_message_of_each_topic_is_found(recording: Recording, file: Path):
    """The same as a reader finds that reads everything."""
    everything = [each for each in Bag(file).entries() if not each.channel.topic.startswith("/_")]
    for moment_ns in (recording.start_ns, recording.start_ns + 31 * S + 5, recording.end_ns, recording.end_ns + S):
        wanted = {each.channel.topic: each for each in everything if each.log_time_ns <= moment_ns}
        found = recording.at(moment_ns, recording.topics.keys())
        assert {recording.topics[id_].channel.topic: each for id_, each in found.items()} == {
            name: each for name, each in wanted.items() if name in {t.channel.topic for t in recording.topics.values()}
        }
    assert recording.at(recording.start_ns - 1, recording.topics.keys()) == {}


def test_messages_from_a_moment_are_in_order(recording: Recording):
    since_ns = recording.start_ns + 59 * S
    reading = recording.from_(since_ns, {2, 3})
    stamps = [entry.log_time_ns for _, entry in reading]
    assert stamps == sorted(stamps)
    assert stamps[0] >= since_ns
    assert len(stamps) == 22


def test_a_recording_has_a_graph_and_a_log(recording: Recording):
    graph = graph_of(recording, recording.end_ns)
    assert [each["name"] for each in graph["nodes"]] == ["/sensor_processor", "/sensor_publisher"]
    (imu,) = [each for each in graph["topics"] if each["name"] == "/imu/data"]
    assert (imu["published"], imu["publishers"][0]["node"]) == (600, "/sensor_publisher")
    assert log_of(recording, recording.start_ns, 100) == []
    (line,) = log_of(recording, recording.end_ns, 100)
    assert (line["text"], line["node"], line["level"]) == ("All sensors operational", "/sensor_processor", 20)


def test_rates_are_those_of_the_moment(recording: Recording):
    """The lab logs one line, half a second after its start."""
    names = {id_: each.channel.topic for id_, each in recording.topics.items()}
    moments = {"start": recording.start_ns, "middle": recording.start_ns + 30 * S, "end": recording.end_ns}
    found = {
        word: {names[id_]: rate for id_, rate in recording.rates_hz(moment_ns).items()}
        for word, moment_ns in moments.items()
    }
    assert [found[word]["/rosout"] for word in moments] == [pytest.approx(1 / 1.5, abs=0.001), 0, 0]
    assert [found[word]["/imu/data"] for word in moments] == [pytest.approx(10, abs=1)] * 3


def test_what_is_no_recording_is_refused(tmp_path: Path):
    (tmp_path / "no.mcap").write_text("nothing")
    with pytest.raises(BagError):
        opened(tmp_path / "no.mcap")


# Numbers over the whole of it.


def numbers(file: Path, topic: str, *fields: str) -> list[tuple[int, float]]:
    """Stamp and number of each message, by a reader that reads everything."""
    found: list[tuple[int, float]] = []
    for each in Bag(file).entries([topic]):
        value = message = each.channel.plain(each.payload)
        for field in fields:
            value = value[field]
        stamp = message["header"]["stamp"]
        found.append((stamp["sec"] * S + stamp["nanosec"], value))
    return found


def test_an_overview_keeps_every_peak(recording: Recording, file: Path):
    known = numbers(file, "/imu/data", "linear_acceleration", "z")
    stretch = Stretch(recording.start_ns, recording.end_ns, 20)
    found = overview(recording, "/imu/data", ["linear_acceleration", "z"], stretch)
    assert found["every"] == 1
    assert len(found["values"]) <= 40
    assert max(found["values"]) == max(value for _, value in known)
    assert min(found["values"]) == min(value for _, value in known)
    points = dict(known)
    start_ns = int(found["from_ns"])
    for time_s, value in zip(found["times_s"], found["values"], strict=True):
        assert points[start_ns + round(time_s * S)] == value


def test_a_narrow_overview_has_every_point(recording: Recording, file: Path):
    stretch = Stretch(recording.start_ns + 10 * S, recording.start_ns + 20 * S, 4000)
    found = overview(recording, "/imu/data", ["linear_acceleration", "z"], stretch)
    known = numbers(file, "/imu/data", "linear_acceleration", "z")
    inside = [value for stamp_ns, value in known if stretch.start_ns <= stamp_ns <= stretch.end_ns]
    assert found["values"] == inside


def test_an_overview_of_much_reads_a_part(recording: Recording, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("busflow_ui.recordings.overview._MOST_READ", 100)
    found = overview(
        recording, "/imu/data", ["linear_acceleration", "z"], Stretch(recording.start_ns, recording.end_ns, 4000)
    )
    assert found["every"] == 6
    assert 90 <= len(found["values"]) <= 101


def test_a_path_leads_to_items_and_names():
    message = {"name": ("a", "b"), "position": (1.0, 2.0), "parts": ({"name": "x", "size": 3},)}
    assert value_at(["position", 1], message) == 2.0
    assert value_at(["position", -2], message) == 1.0
    assert value_at(["position", Named("b")], message) == 2.0
    assert value_at(["parts", Named("x"), "size"], message) == 3
    assert value_at([0, Named("imu"), "x"], [[{"child_frame_id": "imu", "x": 5}]]) == 5
    for path in (["position", 2], ["position", Named("c")], ["nothing"], ["name", "a"], [Named("name"), 5]):
        assert value_at(path, message) is None


# A page that looks at it.


class Viewer:
    """A page's end of the connection."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.data: list[tuple[int, int]] = []
        """Subscription and seconds since the beginning of each message."""

    async def until(self, holds: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        async for message in self.socket:
            if isinstance(message, str):
                found = json.loads(message)
                if holds(found):
                    return found
            elif message[0] == 1:
                self.data.append(struct.unpack_from("<BIQ", message)[1:])
            elif holds({"op": "time", "now_ns": struct.unpack_from("<BQ", message)[1]}):
                return {}
        raise AssertionError("it was closed")

    async def ask(self, question: str, **arguments: Any) -> dict[str, Any]:
        frame = {"op": "busflow/ask", "id": 1, "question": question, "arguments": arguments}
        await self.socket.send(json.dumps(frame))
        return await self.until(lambda found: found["op"] == "busflow/answer")

    async def send(self, op: str, **fields: Any) -> None:
        await self.socket.send(json.dumps({"op": op, **fields}))


def looking(recording: Recording, look: Callable[[Viewer], Any]) -> None:
    """Have a page look at a recording."""

    async def handle(connection: ServerConnection) -> None:
        await RecordingPage(connection, recording, print_message=print).serve('{"op":"serverInfo"}')

    async def main() -> None:
        async with asyncio.timeout(PATIENCE_S), serve(handle, "127.0.0.1", 0) as server:
            port = server.sockets[0].getsockname()[1]
            socket = await connect(f"ws://127.0.0.1:{port}")
            await look(Viewer(socket))
            await socket.close()

    asyncio.run(main())


def test_a_page_goes_to_a_moment(recording: Recording):
    async def look(viewer: Viewer) -> None:
        await viewer.send("subscribe", subscriptions=[{"id": 7, "channelId": 2}, {"id": 8, "channelId": 5}])
        await viewer.until(lambda found: found["op"] == "time")
        at_ns = recording.start_ns + 30 * S + 50_000_000
        viewer.data.clear()
        found = await viewer.ask("seek", stamp_ns=str(at_ns))
        assert found["answer"]["stamp_ns"] == str(at_ns)
        await viewer.until(lambda found: found["op"] == "time")
        assert viewer.data == [(8, recording.start_ns + S // 2), (7, recording.start_ns + 30 * S)]

    looking(recording, look)


def test_page_is_sent_rates_of_its_moment(recording: Recording):
    async def look(viewer: Viewer) -> None:
        def rates(found: dict[str, Any]) -> dict[str, float]:
            topics = found["answer"]["topics"] if found.get("question") == "graph" else ()
            return {each["name"]: each["rate_hz"] for each in topics}

        await viewer.send("busflow/follow", question="graph", on=True)
        await viewer.until(lambda found: rates(found).get("/rosout", 0) > 0)
        await viewer.ask("seek", stamp_ns=str(recording.start_ns + 30 * S))
        await viewer.until(lambda found: rates(found).get("/rosout") == 0)

    looking(recording, look)


def test_page_is_sent_the_log_of_its_moment(recording: Recording):
    async def look(viewer: Viewer) -> None:
        def is_log(lines: int) -> Callable[[dict[str, Any]], bool]:
            return lambda found: found.get("question") == "log" and len(found["answer"]["lines"]) == lines

        await viewer.send("busflow/follow", question="log", on=True)
        await viewer.until(is_log(0))
        await viewer.ask("seek", stamp_ns=str(recording.end_ns))
        await viewer.until(is_log(1))
        await viewer.ask("seek", stamp_ns=str(recording.start_ns))
        await viewer.until(is_log(0))

    looking(recording, look)


def test_a_moment_shows_every_frame(recording: Recording, monkeypatch: pytest.MonkeyPatch):
    """A message has the transforms of one node: with the last one alone the other frames would be missing."""
    (imu,) = [id_ for id_, each in recording.topics.items() if each.channel.topic == "/imu/data"]
    moment_ns = recording.start_ns + 30 * S
    assert len(recording.shown_at(moment_ns, {imu})) == 1
    for word, count in (("_TRANSFORMS", 10), ("_FIXED_TRANSFORMS", 300)):
        with monkeypatch.context() as patch:
            patch.setattr(f"busflow_ui.recordings.recording.{word}", "/imu/data")
            assert len(recording.shown_at(moment_ns, {imu})) == pytest.approx(count, abs=1)


def test_a_page_plays_every_message_once(recording: Recording):
    async def look(viewer: Viewer) -> None:
        await viewer.send("busflow/follow", question="time", on=True)
        await viewer.send("subscribe", subscriptions=[{"id": 7, "channelId": 2}])
        await viewer.until(lambda found: found["op"] == "time")
        await viewer.ask("seek", play=True, rate=100)
        await viewer.until(lambda found: found["op"] == "busflow/update" and not found["answer"]["playing"])
        stamps = [stamp for _, stamp in viewer.data]
        assert stamps == sorted(set(stamps))
        assert len(stamps) == 600
        again = await viewer.ask("seek", play=True)
        assert int(again["answer"]["stamp_ns"]) == recording.start_ns

    looking(recording, look)


def test_a_page_pauses_where_it_is(recording: Recording):
    async def look(viewer: Viewer) -> None:
        at_ns = recording.start_ns + 10 * S
        await viewer.ask("seek", stamp_ns=str(at_ns), play=True, rate=0.001)
        paused = (await viewer.ask("seek", play=False))["answer"]
        assert not paused["playing"]
        assert at_ns <= int(paused["stamp_ns"]) < at_ns + S
        assert (await viewer.ask("time"))["answer"] == paused

    looking(recording, look)


@pytest.mark.parametrize(
    "arguments", [{"stamp_ns": "-1"}, {"rate": 0}, {"rate": 1e9}, {"play": "yes"}, {"stamp_ns": "9" * 40}]
)
def test_a_wrong_seek_is_refused(recording: Recording, arguments: dict[str, Any]):
    async def look(viewer: Viewer) -> None:
        assert "error" in await viewer.ask("seek", **arguments)

    looking(recording, look)


@pytest.mark.parametrize(
    "arguments",
    [
        {"topic": "/nothing", "path": ["x"]},
        {"topic": "/imu/data", "path": []},
        {"topic": "/imu/data", "path": [True]},
        {"topic": "/imu/data", "path": ["x"], "bins": 10**9},
        {"topic": "/imu/data", "path": ["x"], "from_ns": "9", "to_ns": "8"},
    ],
)
def test_a_wrong_overview_is_refused(recording: Recording, arguments: dict[str, Any], golden: Golden):
    async def look(viewer: Viewer) -> None:
        golden((await viewer.ask("overview", **arguments))["error"])

    looking(recording, look)


def test_an_overview_without_numbers_is_a_gap(recording: Recording):
    async def look(viewer: Viewer) -> None:
        found = (await viewer.ask("overview", topic="/imu/data", path=["header", "frame_id"], bins=3))["answer"]
        assert found["values"] == [None, None, None]

    looking(recording, look)


def test_a_recording_cannot_be_steered(recording: Recording, golden: Golden):
    async def look(viewer: Viewer) -> None:
        await viewer.send("setParameters", parameters=[{"name": "/a.b", "value": 1}])
        found = await viewer.until(lambda found: found["op"] == "status")
        golden(found["message"])
        assert "error" in await viewer.ask("order", node="/a", order="stop")

    looking(recording, look)


def test_an_empty_recording_is_refused(file: Path, golden: Golden):
    class Empty(Bag):
        start_ns = None
        incomplete = ("it was cut off",)

    with Empty(file) as bag, golden.raises(InvalidInput) as caught:
        Recording(bag)
    assert caught.value.code == "empty"
