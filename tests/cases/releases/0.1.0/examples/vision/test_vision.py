"""The tracker follows the disc, and loses no image on virtual time."""

from math import cos, pi, sin
from pathlib import Path

import pytest

from busflow.msgs.geometry_msgs import PointStamped
from busflow.testing import harness, virtual_time

FILE = Path(__file__).parent / "vision.yaml"


@virtual_time
async def test_tracker_follows_the_disc():
    async with harness(FILE) as lab:
        await lab.advance(4)
        found = lab.received("disc", PointStamped)
        assert len(found) == 120
        assert lab.ledger.dropped == 0
        for each in found:
            angle = (each.header.stamp.sec % 1000 + each.header.stamp.nanosec / 1e9) * pi / 2
            assert each.point.x == pytest.approx(80 + 40 * cos(angle), abs=0.6)
            assert each.point.y == pytest.approx(60 + 30 * sin(angle), abs=0.6)


@virtual_time
async def test_nothing_is_found_above_the_threshold():
    async with harness(FILE) as lab:
        lab.set_parameters("tracker", threshold=255)
        await lab.advance(1)
        assert lab.received("disc", PointStamped) == []
