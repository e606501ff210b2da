"""A recorder outside the run writes what it receives, counts what it missed, and finishes its file."""

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from busflow import Node, Parameters, QoS, publisher
from busflow.bus.patterns import Selection
from busflow.errors import RecordingRefused
from busflow.launchfile.model.description import Compression, Split
from busflow.msgs.std_msgs import Int64
from busflow.processes.remote_recorder import RemoteRecorder
from busflow.recording.bag.bag import Bag
from busflow.wire.zenoh.keys import Attachment

pytestmark = pytest.mark.asyncio


class CounterParameters(Parameters):
    step: int = 3


class Counter(Node):
    parameters: CounterParameters
    numbers = publisher(Int64, "numbers")
    kept = publisher(Int64, "kept", qos=QoS(durability="transient_local"))


def recorder_of(looked: Any, to: Any, *topics: str, **words: Any) -> RemoteRecorder:
    return RemoteRecorder(looked.peer, Selection(topics), to=str(to), compression=Compression.NONE, **words)


def written(path: Any) -> list[tuple[str, int, Any]]:
    """Topic, sequence number and number of each message of a recording, without the parameters."""
    with Bag(path) as bag:
        entries = [entry for entry in bag.entries() if entry.channel.topic != "/parameter_events"]
        return [(each.channel.topic, each.sequence, each.channel.plain(each.payload)["data"]) for each in entries]


async def test_messages_are_recorded_in_order(looked_at: Any, tmp_path: Any):
    async with looked_at(Counter) as looked:
        recorder = await looked.ask(recorder_of, looked, tmp_path / "{name}.mcap", "numbers")
        await looked.ask(recorder.follow)
        await looked.ask(looked.peer.settle)
        for number in range(3):
            looked.graph.node(Counter).numbers.publish(Int64(data=number))
        await looked.until(lambda: recorder.published == 3)
        await looked.ask(recorder.close)
    assert recorder.path == tmp_path / "looked.mcap"
    assert recorder.topics == ("/numbers",)
    assert (recorder.recorded, recorder.missed, recorder.complete, recorder.failure) == (4, 0, True, None)
    assert written(recorder.path) == [("/numbers", 2 + number, number) for number in range(3)]


async def test_parameters_of_the_beginning_come_first(looked_at: Any, tmp_path: Any):
    async with looked_at(Counter) as looked:
        recorder = await looked.ask(recorder_of, looked, tmp_path / "run.mcap")
        await looked.ask(recorder.close)
    assert (recorder.nodes, recorder.recorded, recorder.published, recorder.complete) == (1, 1, 0, True)
    with Bag(recorder.path) as bag:
        (entry,) = bag.entries()
        event = entry.channel.plain(entry.payload)
    assert (event["node"], [each["name"] for each in event["new_parameters"]]) == ("/counter", ["step"])


async def test_lost_messages_leave_a_gap(looked_at: Any, tmp_path: Any, monkeypatch: pytest.MonkeyPatch):
    listeners = []
    async with looked_at(Counter) as looked:
        listen = looked.peer.listen
        monkeypatch.setattr(
            looked.peer,
            "listen",
            lambda *args, listener: listeners.append(listener) or listen(*args, listener=listener),
        )
        recorder = await looked.ask(recorder_of, looked, tmp_path / "run.mcap", "numbers")
        await looked.ask(recorder.follow)
        (listener,) = listeners
        for sequence in (1, 2, 5):
            listener.put(sample(sequence))
        await looked.ask(recorder.close)
    assert (recorder.published, recorder.missed, recorder.complete) == (3, 2, False)
    assert [sequence for _, sequence, _ in written(recorder.path)] == [2, 3, 6]


def sample(sequence: int) -> Any:
    """What Zenoh hands over, as far as a listener looks at it: the number 7."""
    payload, attachment = b"\0\1\0\0" + (7).to_bytes(8, "little"), Attachment(sequence, 5, bytes(16)).encode()
    return SimpleNamespace(
        payload=SimpleNamespace(to_bytes=lambda: payload), attachment=SimpleNamespace(to_bytes=lambda: attachment)
    )


async def test_follow_finds_new_topics(looked_at: Any, tmp_path: Any):
    async with looked_at(Counter) as looked:
        recorder = await looked.ask(recorder_of, looked, tmp_path / "run.mcap", "late", "never")
        await looked.ask(recorder.follow)
        assert (recorder.topics, recorder.unmatched) == ((), ("late", "never"))
        late = looked.graph.advertise(Int64, "late")
        async with asyncio.timeout(60):
            while not recorder.topics:
                await looked.ask(recorder.follow)
        await looked.ask(looked.peer.settle)
        late.publish(Int64(data=8))
        await looked.until(lambda: recorder.published)
        await looked.ask(recorder.close)
    assert recorder.unmatched == ("never",)
    assert written(recorder.path) == [("/late", 2, 8)]


async def test_existing_file_is_refused(looked_at: Any, tmp_path: Any):
    (tmp_path / "run.mcap").write_text("mine")
    async with looked_at(Counter) as looked:
        with pytest.raises(RecordingRefused, match=r"run\.mcap"):
            await looked.ask(recorder_of, looked, tmp_path / "run.mcap")
    assert (tmp_path / "run.mcap").read_text() == "mine"


async def test_each_part_repeats_kept_messages(looked_at: Any, tmp_path: Any):
    async with looked_at(Counter) as looked:
        looked.graph.node(Counter).kept.publish(Int64(data=5))
        recorder = await looked.ask(
            recorder_of, looked, tmp_path / "run", "kept", "numbers", split=Split(duration_s=1e-6)
        )
        await looked.ask(recorder.follow)
        await looked.until(lambda: recorder.published == 1)
        await looked.ask(looked.peer.settle)
        for number in range(2):
            looked.graph.node(Counter).numbers.publish(Int64(data=number))
            await looked.until(lambda number=number: recorder.published == 2 + number)
        await looked.ask(recorder.close)
    parts = sorted(recorder.path.glob("*.mcap"))
    assert len(parts) >= 3
    assert ("/kept", 5) in [(topic, number) for topic, _, number in written(parts[-1])]
    assert (recorder.path / "metadata.yaml").exists()
    assert recorder.complete
