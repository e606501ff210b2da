"""A pose as a frame, and with it the lab's body in 3D."""

from pathlib import Path

import pytest

from busflow import Node, transforms
from busflow.msgs.geometry_msgs import PoseStamped
from busflow.testing import harness, virtual_time

LAB = Path(__file__).parents[2] / "configs/lab_balance_3d.yaml"


class Viewer(Node):
    frames = transforms()


@virtual_time
async def test_lab_in_3d_stands_on_the_floor():
    async with harness(LAB, Viewer) as lab:
        await lab.advance(3)
        frames, pose = lab.node(Viewer).frames, lab.received("pelvis/pose", PoseStamped)[-1]
        pelvis, foot = frames.latest("world", "pelvis"), frames.latest("world", "left_foot")
    assert pelvis.header.stamp == pose.header.stamp
    at, turned = pelvis.transform.translation, pelvis.transform.rotation
    assert (at.x, at.y, at.z) == (pose.pose.position.x, pose.pose.position.y, pose.pose.position.z)
    assert turned.y == pytest.approx(pose.pose.orientation.y)
    assert foot.transform.translation.z == pytest.approx(0.05, abs=0.01)  # the sole is 5 cm below the ankle
    assert len(frames.names) == 15
