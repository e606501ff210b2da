"""Snapshots: the last moments of a run, in memory until they are asked for or something fails."""

import pytest

from busflow import Node, QoS, publisher, supervised, timer
from busflow.cli import main
from busflow.errors import ExitCode, NoSuchTarget, RecordingRefused
from busflow.launchfile.model.supervision import Restart, RestartPolicy
from busflow.msgs.std_msgs import Int64, String
from busflow.recording.bag.bag import Bag
from busflow.recording.recorder import snapshot as recorder
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


class Faulty(Source):
    """Fails every two seconds."""

    @timer(2.0)
    def fail(self) -> None:
        raise ValueError("no current")


def record(tmp_path, **more):
    return {"to": str(tmp_path / "run.mcap"), "snapshot": "3s", **more}


def counts(bag):
    return [entry.channel.decode(entry.payload, Int64).data for entry in bag.entries(["/count"])]


def bags(tmp_path):
    return sorted(path.name for path in tmp_path.iterdir())


@virtual_time
async def test_a_snapshot_holds_the_last_moments(tmp_path):
    async with harness(Source, record=record(tmp_path)) as lab:
        await lab.advance(20.05)
        assert bags(tmp_path) == []
        path = lab.graph.snapshot("a test").path
        assert bags(tmp_path) == ["run-001.mcap"]
        await lab.advance(1)
    with Bag(path) as bag:
        assert counts(bag) == list(range(171, 201))
        assert bag.complete
        assert bag.survey().gaps == 0
        assert bag.ledger.recorded == bag.messages - 1  # the description is a repeat
        (description,) = bag.entries(["/description"])
        assert description.channel.decode(description.payload, String).data == "a robot"
        assert (description.sequence, description.log_time_ns) == (0, bag.start_ns)
        assert description.log_time_ns - description.publish_time_ns > 17 * 10**9
    (report,) = lab.graph.report().snapshots
    assert (report.path, report.reason, report.written, report.complete) == (path, "a test", True, True)
    assert report.recorded == bag.ledger.recorded


@virtual_time
async def test_what_follows_a_snapshot_is_in_it(tmp_path):
    async with harness(Source, record=record(tmp_path, after="1.5s")) as lab:
        await lab.advance(10.05)
        path = lab.graph.snapshot().path
        await lab.advance(1.4)
        assert not lab.graph.report().snapshots[0].written
        await lab.advance(5)
        assert lab.graph.report().snapshots[0].complete
    with Bag(path) as bag:
        assert counts(bag) == list(range(71, 116))


@virtual_time
async def test_snapshots_that_overlap_are_whole(tmp_path):
    async with harness(Source, record=record(tmp_path, after="2s")) as lab:
        for _ in range(3):
            await lab.advance(1)
            lab.graph.snapshot()
        await lab.advance(3)
    assert bags(tmp_path) == ["run-001.mcap", "run-002.mcap", "run-003.mcap"]
    for name, last in zip(bags(tmp_path), (30, 40, 50), strict=True):
        with Bag(tmp_path / name) as bag:
            assert counts(bag)[-1] in {last - 1, last}
            assert bag.complete
            assert bag.survey().gaps == 0


@virtual_time
async def test_the_end_finishes_a_snapshot_early(tmp_path):
    async with harness(Source, record=record(tmp_path, after="1h")) as lab:
        await lab.advance(2.05)
        path = lab.graph.snapshot().path
        await lab.advance(1)
    with Bag(path) as bag:
        assert counts(bag) == list(range(1, 31))
        assert bag.complete


@virtual_time
async def test_a_failure_writes_a_snapshot(tmp_path):
    async with harness(Faulty, expect_failure=Faulty, record=record(tmp_path)) as lab:
        await lab.advance(5)
    (report,) = lab.graph.report().snapshots
    assert report.reason.startswith("/faulty failed in Faulty.fail")
    assert "no current" in report.reason
    with Bag(report.path) as bag:
        assert counts(bag)[:19] == list(range(1, 20))
        assert bag.complete
        lines = [entry.channel.plain(entry.payload)["msg"] for entry in bag.entries(["/rosout"])]
        assert any("no current" in line for line in lines)


@virtual_time
async def test_failures_write_so_many_snapshots_only(tmp_path):
    node = supervised(Faulty, restart=RestartPolicy(Restart.ALWAYS, most=1000))
    async with harness(node, record=record(tmp_path)) as lab:
        await lab.advance(300)
        assert lab.graph.report().nodes[0].failures > recorder.MOST_FOR_FAILURES
        assert len(bags(tmp_path)) == recorder.MOST_FOR_FAILURES
        lab.graph.snapshot()
    assert len(bags(tmp_path)) == recorder.MOST_FOR_FAILURES + 1
    assert any("last of 10 snapshots" in line.event for line in lab.log)


@virtual_time
async def test_bytes_limit_what_is_kept(tmp_path):
    """Case cache/circular-overwrites-old."""
    async with harness(Source, record=record(tmp_path, bytes="8KiB")) as lab:
        await lab.advance(10.05)
        path = lab.graph.snapshot().path
    with Bag(path) as bag:
        assert 5 < len(counts(bag)) < 30
        assert counts(bag)[-1] == 100
        assert bag.complete
        assert len(list(bag.entries(["/description"]))) == 1


@virtual_time
async def test_many_at_once_share_the_last(tmp_path):
    async with harness(Source, record=record(tmp_path, after=5)) as lab:
        await lab.advance(1)
        paths = [lab.graph.snapshot().path for _ in range(recorder.MOST_AT_ONCE + 2)]
        assert len(set(paths)) == recorder.MOST_AT_ONCE
        assert paths[-3] == paths[-2] == paths[-1]


@virtual_time
async def test_earlier_snapshots_are_never_overwritten(tmp_path):
    (tmp_path / "run-001.mcap").write_text("precious")
    (tmp_path / "run-002").mkdir()
    async with harness(Source, record=record(tmp_path)) as lab:
        await lab.advance(1)
        assert lab.graph.snapshot().path == str(tmp_path / "run-003.mcap")
    assert (tmp_path / "run-001.mcap").read_text() == "precious"


@virtual_time
async def test_a_run_without_the_key_says_so(tmp_path, golden):
    async with harness(Source, record=tmp_path / "run.mcap") as lab:
        with golden.raises(NoSuchTarget):
            lab.graph.snapshot()


@virtual_time
async def test_a_missing_folder_is_refused_at_the_start(tmp_path, golden):
    with golden.raises(RecordingRefused):
        async with harness(Source, record={"to": str(tmp_path / "none/run.mcap"), "snapshot": 1}):
            pass


LAUNCH = """
name: source
plugins: [{folder}]
clock: {{mode: sim}}
nodes:
  source: {{plugin: source}}
record: {{to: "{folder}/{{name}}.mcap", snapshot: 3s}}
expect:
  topics: {{/count: {{values: {{data: [0, 100]}}}}}}
"""


def launch_file(tmp_path):
    (tmp_path / "source.py").write_text(
        "from busflow import Node, publisher, timer\nfrom busflow.msgs.std_msgs import Int64\n\n\n"
        "class Source(Node):\n    counted = publisher(Int64, '/count')\n    count = 0\n\n    @timer(hz=10)\n"
        "    def tick(self):\n        self.count += 1\n        self.counted.publish(Int64(data=self.count))\n"
    )
    file = tmp_path / "source.yaml"
    file.write_text(LAUNCH.format(folder=tmp_path))
    return file


def test_a_broken_expectation_writes_a_snapshot(tmp_path, capsys, golden):
    file = launch_file(tmp_path)
    assert main(["test", str(file), "--for", "9s"]) == 0
    assert list(tmp_path.glob("*.mcap")) == []
    capsys.readouterr()
    assert main(["test", str(file), "--for", "12s", "--seeds", "3"]) == ExitCode.FAILED
    out = capsys.readouterr().out
    (path,) = tmp_path.glob("*.mcap")  # of the first seed alone: the others show nothing new
    assert f"{path}: " in out
    golden(out)
    with Bag(path) as bag:
        assert counts(bag)[-1] == 120
        assert bag.complete


def test_a_run_reports_its_snapshots(tmp_path, capsys):
    file = launch_file(tmp_path)
    (tmp_path / "source.py").write_text(
        (tmp_path / "source.py").read_text() + "        if self.count == 50:\n            raise ValueError('burnt')\n"
    )
    assert main(["run", str(file), "--report", str(tmp_path / "out.json")]) == ExitCode.FAILED
    assert "source-001.mcap: " in capsys.readouterr().out
    assert main(["bag", "info", str(tmp_path / "source-001.mcap")]) == 0
    assert "snapshot     /source failed in Source.tick" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ("snapshot: 60s, split: {size: 1MB}", "leave one of them out"),
        ("to: run.mcap, after: 5s", "after: belongs to snapshot"),
        ("exclude: [/a]", "a recording needs a file"),
        ("snapshot: 0s", "a duration is at least 1 ns"),
        ("snapshot: 60s, bytes: 5", "at least 1024"),
    ],
)
def test_keys_that_cannot_be_are_errors(tmp_path, capsys, keys, text):
    """Case writer/snapshot mode with cache 0."""
    file = tmp_path / "a.yaml"
    file.write_text(f"nodes: {{}}\nrecord: {{{keys}}}\n")
    assert main(["check", str(file)]) == ExitCode.DIFFERENT
    assert text in capsys.readouterr().out
