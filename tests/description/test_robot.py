"""Forward kinematics, compared with what MuJoCo computes from the same URDF file."""

from __future__ import annotations

import math
from pathlib import Path
from random import Random
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import yaml

from busflow.description.robot import MOVES, JointKind, Robot
from busflow.description.urdf import read_robot
from busflow.frames.moving import rotation_matrix
from busflow.frames.rigid import Rigid
from busflow.frames.tree import FrameTree, Gap
from tests.extras import require_extra

require_extra("sim")
import mujoco  # noqa: E402  # only with the extra

FOLDER = Path(__file__).parents[2] / "configs/humanoid"
AS_IT_IS = (
    '<mujoco><compiler fusestatic="false" discardvisual="false" boundmass="1" boundinertia="1"/></mujoco>'  # all links
)
TYPES = [JointKind.FIXED, JointKind.REVOLUTE, JointKind.CONTINUOUS, JointKind.PRISMATIC]


def any_robot(random: Random) -> str:
    """A tree of links under joints of all kinds, some of which mimic others, in any order of the file."""
    lines = ['<link name="l0"/>']
    moving: list[str] = []
    for number in range(1, random.randint(2, 12)):
        kind = random.choice(TYPES)
        xyz, rpy, axis = (" ".join(repr(random.uniform(-2, 2)) for _ in range(3)) for _ in range(3))
        mimic = ""
        if kind in MOVES and moving and random.random() < 0.4:
            factor, offset = random.uniform(-2, 2), random.uniform(-1, 1)
            mimic = f'<mimic joint="{random.choice(moving)}" multiplier="{factor!r}" offset="{offset!r}"/>'
        if kind in MOVES:
            moving.append(f"j{number}")
        ends = f'<parent link="l{random.randrange(number)}"/><child link="l{number}"/>'
        place = f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
        limit = '<limit lower="-9" upper="9" effort="1" velocity="1"/>'
        lines += [
            f'<link name="l{number}"/>',
            f'<joint name="j{number}" type="{kind}">{mimic}{ends}{place}{limit}</joint>',
        ]
    random.shuffle(lines)
    return "\n".join(["<robot name='any'>", *lines, "</robot>"])


def placed(robot: Robot, positions: dict[str, float]) -> dict[str, Rigid]:
    """Where the links are by busflow's tree of frames, seen from the root."""
    tree = FrameTree()
    for joint in robot.joints:
        motion = joint.motion(positions[joint.source]) if joint.kind in MOVES else joint.origin
        tree.take_fixed(joint.parent, joint.child, motion)
    found: dict[str, Rigid] = {}
    for joint in robot.joints:
        answer = tree.find(robot.root, joint.child, None)
        assert not isinstance(answer, Gap)
        found[joint.child] = answer[0]
    return found


def placed_by_mujoco(text: str, positions: dict[str, float]) -> dict[str, tuple[Any, Any]]:
    """Where the links are by MuJoCo: position and matrix, seen from the root, which stands at its origin."""
    model = mujoco.MjModel.from_xml_string(text.replace("</robot>", f"{AS_IT_IS}</robot>"))
    data = mujoco.MjData(model)
    names = [model.joint(number).name for number in range(model.njnt)]
    known = {name: positions[name] for name in names if name in positions}
    while len(known) < len(names):  # those that mimic others, as MuJoCo has read them
        for number in range(model.neq):
            own, source = names[model.eq_obj1id[number]], names[model.eq_obj2id[number]]
            if source in known:
                offset, factor = model.eq_data[number][:2]
                known[own] = offset + factor * known[source]
    for number, name in enumerate(names):
        data.qpos[model.jnt_qposadr[number]] = known[name]
    mujoco.mj_kinematics(model, data)
    links = {model.body(number).name: number for number in range(1, model.nbody)}
    return {name: (data.xpos[number].copy(), data.xmat[number].reshape(3, 3).copy()) for name, number in links.items()}


def assert_same(text: str, robot: Robot, random: Random) -> None:
    positions = {each.source: random.uniform(-math.pi, math.pi) for each in robot.joints if each.kind in MOVES}
    found, expected = placed(robot, positions), placed_by_mujoco(text, positions)
    assert found.keys() == expected.keys() - {robot.root}
    for link, motion in found.items():
        at, turn = expected[link]
        np.testing.assert_allclose(motion[:3], at, rtol=0, atol=1e-9, err_msg=link)
        np.testing.assert_allclose(rotation_matrix(motion[3:]), turn, rtol=0, atol=1e-9, err_msg=link)


@pytest.mark.parametrize("seed", range(40))
def test_links_of_any_robot_are_where_mujoco_says(seed: int, tmp_path: Path):
    random = Random(seed)
    text = any_robot(random)
    file = tmp_path / "robot.urdf"
    file.write_text(text)
    assert_same(text, read_robot(file, {}), random)


def test_links_of_the_humanoid_are_where_mujoco_says():
    random = Random(0)
    robot = read_robot(FOLDER / "humanoid.urdf", {})
    for _ in range(5):
        assert_same(robot.text, robot, random)


def test_description_of_the_lab_is_its_body():
    """A viewer shows what MuJoCo steps: the links of `lab.urdf` are where the bodies of `lab.xml` are."""
    robot = read_robot(FOLDER / "lab.urdf", {})
    model = mujoco.MjModel.from_xml_path(str(FOLDER / "lab.xml"))
    data, random = mujoco.MjData(model), Random(0)
    positions = {model.joint(number).name: random.uniform(-1, 1) for number in range(1, model.njnt)}
    for name, position in positions.items():
        data.joint(name).qpos = position
    data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]  # the pelvis stands at the origin
    mujoco.mj_kinematics(model, data)
    found = placed(robot, positions)
    sites = {"imu_link": "imu", "left_foot_link": "left_sole", "right_foot_link": "right_sole"}
    assert found.keys() == {model.body(number).name for number in range(2, model.nbody)} | sites.keys()
    for link, motion in found.items():
        there = data.site(sites[link]) if link in sites else data.body(link)
        np.testing.assert_allclose(motion[:3], there.xpos, rtol=0, atol=1e-9, err_msg=link)
        np.testing.assert_allclose(rotation_matrix(motion[3:]), there.xmat.reshape(3, 3), atol=1e-9, err_msg=link)


def test_limits_of_the_humanoid_are_its_simulators():
    root = ET.parse(FOLDER / "humanoid.urdf").getroot()  # noqa: S314  # our own file
    joints = [each for each in root.iter("joint") if each.attrib["type"] != "fixed"]
    limits = {
        each.attrib["name"]: [float(each.find("limit").get(side)) for side in ("lower", "upper")] for each in joints
    }
    limb, trunk = (yaml.safe_load((FOLDER / f"{part}.yaml").read_text())["joints"] for part in ("limb", "trunk"))
    stated = [(f"{side}_{each['name']}", each) for side in ("left", "right") for each in limb]
    stated += [(each["name"], each) for each in trunk]
    assert limits == {name: [each["lower"], each["upper"]] for name, each in stated}
