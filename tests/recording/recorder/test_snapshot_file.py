"""The file of a snapshot: written by a thread on the system's time, read by every command, alone in its failures."""

import asyncio
import os

from rosbags.highlevel import AnyReader

from busflow import Node, QoS, publisher, timer
from busflow.cli import main
from busflow.errors import IncompleteRecording
from busflow.msgs.std_msgs import Int64, String
from busflow.recording.bag.bag import Bag
from busflow.recording.recorder.recorder import record_graph
from busflow.runner.graph import Graph
from busflow.testing import harness, virtual_time


class Source(Node):
    description = publisher(String, "/description", qos=QoS(depth=1, durability="transient_local"))
    counted = publisher(Int64, "/count")
    count = 0

    async def start(self) -> None:
        self.description.publish(String(data="a robot"))

    @timer(hz=10)
    def tick(self) -> None:
        self.count += 1
        self.counted.publish(Int64(data=self.count))


def record(tmp_path, **more):
    return {"to": str(tmp_path / "run.mcap"), "snapshot": "3s", **more}


def counts(bag):
    return [entry.channel.decode(entry.payload, Int64).data for entry in bag.entries(["/count"])]


def bags(tmp_path):
    return sorted(path.name for path in tmp_path.iterdir())


def on_system_time(tmp_path, use, **more):
    """What is left of a run on the system's time; `use` gets the graph once ten messages came."""

    async def run():
        graph = Graph([Source])
        record_graph(graph, record(tmp_path, **more))
        async with graph:
            async for message in graph.subscribe(Int64, "/count"):
                if message.data == 3:
                    break
            await use(graph)
        return graph.report()

    return asyncio.run(run())


def test_a_thread_writes_on_system_time(tmp_path):
    async def use(graph):
        graph.snapshot("one")
        graph.snapshot("two")

    report = on_system_time(tmp_path, use)
    assert [each.reason for each in report.snapshots] == ["one", "two"]
    assert all(each.complete for each in report.snapshots)
    for name in bags(tmp_path):
        assert main(["bag", "verify", str(tmp_path / name)]) == 0
        with AnyReader([tmp_path / name]) as reader:
            assert reader.message_count > 3


def test_a_failed_snapshot_does_not_lose_the_next(tmp_path, golden):
    async def use(graph):
        first = graph.snapshot("first").path
        os.truncate(first, 10)
        graph.publish("/count", Int64(data=1000))
        async for _ in graph.subscribe(Int64, "/count"):
            if graph.report().snapshots[0].written:
                break
        graph.snapshot("second")

    report = on_system_time(tmp_path, use, after="50ms")
    first, second = report.snapshots
    assert not first.complete
    golden(first.why)
    assert second.complete
    with Bag(second.path) as bag:
        assert 1000 in counts(bag)


def test_a_broken_file_ends_a_strict_run(tmp_path, golden):
    async def use(graph):
        os.truncate(graph.snapshot().path, 10)
        await graph.wait()

    with golden.raises(IncompleteRecording):
        on_system_time(tmp_path, use, after="50ms", on_drop="fail")


def test_every_command_takes_a_snapshot(tmp_path, capsys):
    @virtual_time
    async def run():
        async with harness(Source, record=record(tmp_path)) as lab:
            await lab.advance(20)
            lab.graph.snapshot()

    run()
    path = tmp_path / "run-001.mcap"
    for verb in ("convert", "recover"):
        one = tmp_path / f"{verb}.mcap"
        assert main(["bag", verb, str(path), *(["--to", "mcap"] if verb == "convert" else ["-o"]), str(one)]) == 0
        assert main(["bag", "diff", str(path), str(one), "--times"]) == 0
        for each in (path, one):
            assert main(["bag", "verify", str(each)]) == 0, capsys.readouterr().out
    assert main(["bag", "play", str(path), "--rate", "1000"]) == 0
