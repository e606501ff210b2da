"""`frames:` of a launch file: the node that publishes them, for latecomers too."""

from __future__ import annotations

import math

import pytest

from busflow.bus.qos import TRANSIENT_LOCAL
from busflow.launchfile.load.load import load
from busflow.launchfile.yaml.block import text_of
from busflow.msgs.tf2_msgs import TFMessage
from busflow.runner.planning.resolved import resolve
from busflow.testing import harness, virtual_time

LAB = """\
frames:
  base_link:
    imu_link: {xyz: [0, 0, 0.1], rpy: [0, 0, 1.5707963267948966]}
    camera: {quaternion: [0, 0, 0, -1]}
  camera:
    lens: {}
"""


def written(tmp_path, text):
    file = tmp_path / "lab.yaml"
    file.write_text(text)
    return file


@virtual_time
async def test_frames_of_the_file_are_published_for_latecomers(tmp_path):
    async with harness(written(tmp_path, LAB)) as lab:
        await lab.advance(5)
        late = lab.subscribe(TFMessage, "/tf_static", qos=TRANSIENT_LOCAL)
        await lab.settle()
        kept = late.latest
    edges = {(each.header.frame_id, each.child_frame_id): each.transform for each in kept.transforms}
    assert list(edges) == [("base_link", "imu_link"), ("base_link", "camera"), ("camera", "lens")]
    imu = edges["base_link", "imu_link"]
    assert (imu.translation.z, imu.rotation.z) == (0.1, pytest.approx(math.sqrt(0.5)))
    assert edges["base_link", "camera"].rotation.w == -1
    assert edges["camera", "lens"].rotation.w == 1


def test_included_frames_join_those_of_the_file(tmp_path):
    (tmp_path / "body.yaml").write_text(LAB)
    file = written(
        tmp_path, "include: body.yaml\nnamespace: robot\nframes: {base_link: {lidar: {}, camera: {xyz: [1, 2, 3]}}}\n"
    )
    description = load(file, sets=["frames.camera.lens.xyz=[0, 0, 1]"])
    (node,) = description.nodes
    assert (node.full_name, node.plugin) == ("/static_frames", "static_frames")
    stated = node.parameters.data["frames"]
    assert {child for below in stated.values() for child in below} == {"imu_link", "camera", "lens", "lidar"}
    assert stated["base_link"]["camera"]["xyz"] == [1, 2, 3]
    assert stated["camera"]["lens"] == {"xyz": [0, 0, 1]}


def test_shown_description_states_the_frames_once(tmp_path):
    resolved = text_of(resolve(load(written(tmp_path, LAB))))
    assert resolved.startswith("nodes: {}\nframes:\n  base_link:\n    imu_link:\n")
    assert "static_frames" not in resolved
    again = load(written(tmp_path, resolved))
    assert again.nodes[0].parameters.data == load(written(tmp_path, LAB)).nodes[0].parameters.data
