"""The last moments of one process of several: written where and when the process that decides says so."""

import pytest

from busflow import Node, publisher, timer
from busflow.errors import NoSuchTarget
from busflow.launchfile.model.description import RecordSpec, SnapshotSpec
from busflow.msgs.std_msgs import Int64
from busflow.recording.bag.bag import Bag
from busflow.recording.recorder.share import Share
from busflow.recording.recorder.snapshot_share import SnapshotShare
from busflow.testing import harness, virtual_time


class Source(Node):
    counted = publisher(Int64, "/count")
    count = 0

    @timer(hz=10)
    def tick(self) -> None:
        self.count += 1
        self.counted.publish(Int64(data=self.count))
        if self.count == 50:
            raise ValueError("no current")


def lab_of(tmp_path, wanted, reports, **options):
    """A harness whose graph is the process `far` of a run; and what gives it orders."""
    snapshot = SnapshotSpec(3.0, 1 << 20)
    share = Share("far", tmp_path, RecordSpec("unused.mcap", snapshot=snapshot), frozenset({"/source"}), {})
    lab = harness(Source, **options)
    keeper = SnapshotShare(lab.graph, share, snapshot, want=wanted, on_report=reports.append)
    lab.graph.attach(keeper)
    return lab, keeper


@virtual_time
async def test_an_order_writes_the_last_moments(tmp_path):
    reports = []
    lab, keeper = lab_of(tmp_path, print, reports)
    async with lab:
        await lab.advance(2.05)
        keeper.write(tmp_path / "far.mcap", "a test")
        await lab.settle()
        (report,) = reports
        assert (report.path, report.reason, report.complete) == (str(tmp_path / "far.mcap"), "a test", True)
        assert lab.graph.report().snapshots == ()
        with pytest.raises(NoSuchTarget):  # it is not for this process to decide
            lab.graph.snapshot()
    with Bag(tmp_path / "far.mcap") as bag:
        assert bag.facts.process == "far"
        assert [each.channel.plain(each.payload)["data"] for each in bag.entries(["/count"])] == list(range(1, 21))


@virtual_time
async def test_a_failure_waits_for_its_order(tmp_path):
    reports = []

    def want(reason):
        assert "no current" in reason
        keeper.write(tmp_path / "far.mcap", reason)

    lab, keeper = lab_of(tmp_path, want, reports, expect_failure=Source)
    async with lab:
        await lab.advance(6)
    (report,) = reports
    assert report.complete
    with Bag(report.path) as bag:
        assert [each.channel.plain(each.payload)["data"] for each in bag.entries(["/count"])][-1] == 50


@virtual_time
async def test_a_file_that_cannot_be_made_is_reported(tmp_path, golden):
    reports = []
    lab, keeper = lab_of(tmp_path, print, reports)
    async with lab:
        keeper.write(tmp_path / "none/far.mcap", "a test")
        await lab.settle()
    (report,) = reports
    assert (report.written, report.complete) == (True, False)
    golden(report.why)
