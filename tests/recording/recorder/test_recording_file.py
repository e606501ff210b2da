"""A recording in parts: each is whole, and all together are what one file would be."""

import asyncio

import pytest
from rosbags.highlevel import AnyReader

from busflow import Node, QoS, publisher, timer
from busflow.cli import main
from busflow.errors import ExitCode, IncompleteRecording
from busflow.msgs.std_msgs import Int64, String
from busflow.recording.bag.bag import Bag
from busflow.recording.recorder.recorder import record_graph
from busflow.runner.graph import Graph
from busflow.testing import harness, replay, virtual_time

LATCHED = QoS(depth=1, durability="transient_local")


class Map(Node):
    described = publisher(String, "/description", qos=LATCHED)
    static = publisher(String, "/static", qos=LATCHED)
    counted = publisher(Int64, "/count")
    count = 0

    async def start(self):
        self.described.publish(String(data="a robot"))
        self.static.publish(String(data="old"))
        self.static.publish(String(data="map"))

    @timer(hz=100)
    def tick(self):
        self.count += 1
        self.counted.publish(Int64(data=self.count))


class Arm(Node):
    static = publisher(String, "/static", qos=LATCHED)

    async def start(self):
        self.static.publish(String(data="arm"))


def recorded(folder, seconds=2.5, **record):
    """The bag that a run of so many seconds leaves."""

    @virtual_time
    async def run():
        async with harness(Map, Arm, record={"to": str(folder / "run.mcap"), **record}) as lab:
            await lab.advance(seconds)
        assert lab.graph.report().recording.complete

    run()
    return folder / "run"


def names(bag):
    return [each.path.name for each in bag.files]


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """A recording of three parts."""
    return recorded(tmp_path_factory.mktemp("parts"), split={"duration": "1s"})


@pytest.mark.parametrize("split", [{"duration": "1s"}, {"size": "4KiB"}, {"size": 2000, "duration": 2}])
def test_parts_together_equal_one_file(tmp_path, split):
    for folder in ("one", "many"):
        (tmp_path / folder).mkdir()
    recorded(tmp_path / "one")
    with Bag(recorded(tmp_path / "many", split=split)) as bag, Bag(tmp_path / "one/run.mcap") as one:
        assert len(bag.files) > 1
        assert names(bag) == [f"run_{number}.mcap" for number in range(len(bag.files))]
        assert bag.digest() == one.digest()
        assert [(each, each.count) for each in bag.channels] == [(each, each.count) for each in one.channels]
        assert bag.spans() == one.spans()
        assert bag.survey() == one.survey()
        assert bag.complete
        assert bag.ledger == one.ledger


def test_a_part_ends_at_its_size(tmp_path):
    with Bag(recorded(tmp_path, 20, split={"size": "16kB"})) as bag:
        sizes = [each.size for each in bag.files]
        assert len(sizes) > 3
        assert all(16_000 < size < 32_000 for size in sizes[:-1])  # a chunk, the facts and the summary more


def test_each_part_begins_with_latched_messages(parts):
    for number in range(3):
        with Bag(parts / f"run_{number}.mcap") as part:
            assert part.complete
            latched = list(part.entries(["/description", "/static"]))
            texts = [entry.channel.decode(entry.payload, String).data for entry in latched]
            assert texts == ["a robot", *([] if number else ["old"]), "map", "arm"]
            if number:
                assert [entry.sequence for entry in latched] == [0, 0, 0]
                assert {entry.log_time_ns for entry in latched} == {part.start_ns}
                assert all(entry.publish_time_ns < part.start_ns for entry in latched)
            assert part.facts.launch_file or part.facts.run == "graph"
            assert {each.topic for each in part.channels} >= {"/description", "/static", "/count", "/_ticks"}
            assert part.end_ns - part.start_ns < 10**9


def test_every_command_takes_parts_and_directory(parts, tmp_path, capsys):
    for path in (parts, *sorted(parts.glob("*.mcap"))):
        assert main(["bag", "verify", str(path)]) == 0, capsys.readouterr().out
        assert main(["bag", "play", str(path), "--rate", "1000"]) == 0
    capsys.readouterr()
    assert main(["bag", "info", str(parts)]) == 0
    assert "files     3: run_0.mcap … run_2.mcap" in capsys.readouterr().out
    for verb in ("convert", "recover"):
        one = tmp_path / f"{verb}.mcap"
        assert main(["bag", verb, str(parts), *(["--to", "mcap"] if verb == "convert" else ["-o"]), str(one)]) == 0
        assert main(["bag", "verify", str(one)]) == 0, capsys.readouterr().out
        assert main(["bag", "diff", str(parts), str(one), "--times"]) == 0
        with Bag(one) as bag, Bag(parts) as whole:
            assert bag.digest() == whole.digest()
            assert bag.complete
            assert bag.ledger == whole.ledger
    replay(parts, Map, Arm).assert_same()


def test_a_part_alone_converts_to_that_part(parts, tmp_path):
    assert main(["bag", "convert", str(parts / "run_1.mcap"), str(tmp_path / "one.mcap"), "--to", "mcap"]) == 0
    with Bag(tmp_path / "one.mcap") as bag, Bag(parts / "run_1.mcap") as part:
        assert (bag.incomplete, bag.series[0].parts) == ((), part.series[0].parts)
        assert not bag.series[0].whole
        assert list(bag.entries()) == list(part.entries())


def test_readers_of_ros_2_open_the_directory(parts):
    with AnyReader([parts]) as reader, Bag(parts) as bag:
        wanted = [each for each in reader.connections if each.topic == "/count"]
        times = [time for _, time, _ in reader.messages(connections=wanted)]
        assert times == [entry.log_time_ns for entry in bag.entries(["/count"])]


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_a_part_that_is_missing_is_missed(tmp_path, lost):
    directory = recorded(tmp_path, split={"duration": "1s"})
    (directory / "metadata.yaml").unlink()
    (directory / f"run_{lost}.mcap").unlink()
    with Bag(directory) as bag:
        assert any("are missing" in reason for reason in bag.incomplete)
    assert main(["bag", "verify", str(directory)]) == ExitCode.INCOMPLETE


def test_a_part_that_cannot_begin_is_reported(tmp_path, golden):
    reports = []

    @virtual_time
    async def run():
        record = {"to": str(tmp_path / "run.mcap"), "split": {"duration": 1}, "on_drop": "fail"}
        async with harness(Map, record=record) as lab:
            (tmp_path / "run/run_1.mcap").touch()
            reports.append(lab.graph.report)
            await lab.advance(2)

    with golden.raises(IncompleteRecording):
        run()
    report = reports[0]().recording
    with Bag(tmp_path / "run/run_0.mcap") as bag:
        assert report.recorded == bag.messages
        assert bag.complete
        assert report.missed > 0


def test_parts_are_written_on_system_time(tmp_path):
    async def run():
        graph = Graph([Map])
        record_graph(graph, {"to": str(tmp_path / "run.mcap"), "split": {"duration": "50ms"}})
        async with graph:
            async for message in graph.subscribe(Int64, "/count"):
                if message.data == 20:
                    break
        return graph.report().recording

    report = asyncio.run(run())
    assert report.complete
    with Bag(tmp_path / "run") as bag:
        assert len(bag.files) > 2
        assert bag.survey().gaps == 0
        assert bag.messages == report.recorded
        assert bag.complete


def test_a_split_needs_a_limit(tmp_path, capsys, golden):
    file = tmp_path / "a.yaml"
    file.write_text("nodes: {}\nrecord:\n  to: run.mcap\n  split: {size: 64kb}\n")
    assert main(["check", str(file)]) == ExitCode.DIFFERENT
    golden(capsys.readouterr().out)
    file.write_text("nodes: {}\nrecord:\n  to: run.mcap\n  split: {}\n")
    assert main(["check", str(file)]) == ExitCode.DIFFERENT
    golden(capsys.readouterr().out)
