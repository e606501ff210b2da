"""Robots in URDF: each mistake is found before the start, at its line.

`urdf.py`, `parts.py`, `reading.py`, `xml_file.py` and `packages.py`.
`link_frame.py` is tested with the node that uses it.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from busflow import Graph
from busflow.description.packages import package_file
from busflow.description.reading import MOST_PROBLEMS
from busflow.description.robot import JointKind
from busflow.description.urdf import MOST_MIMICS, MOST_PARTS, read_robot
from busflow.description.xml_file import MOST_BYTES, MOST_DEPTH
from busflow.errors import LaunchError, NoSuchTarget, Problem, Severity
from busflow.frames.rigid import from_rpy
from busflow.launchfile.load.load import load
from tests.golden import Golden

LAUNCH = """\
nodes:
  robot_state_publisher:
    plugin: robot_state_publisher
    parameters: {description: robot.urdf}
packages: {lab: meshes}
"""


def robot(*lines: str, links: str = "base arm hand") -> str:
    """A robot of these links and lines, each on a line of its own: the first line is the second of the file."""
    known = " ".join(f'<link name="{name}"/>' for name in links.split())
    return "\n".join(["<robot name='r'>" + known, *lines, "</robot>"]) + "\n"


def joint(inside: str = "", ends: str = "base arm", **attributes: str) -> str:
    """A joint between two links; with `name` and `type`."""
    parent, child = ends.split()
    stated = " ".join(
        f'{name}="{value}"' for name, value in ({"name": "elbow", "type": "continuous"} | attributes).items()
    )
    return f'<joint {stated}><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


WRIST = joint(name="wrist", type="fixed", ends="arm hand")
MESH = '<link name="extra"><visual><geometry><mesh filename="{}"/></geometry></visual></link>' + joint(
    name="extra", ends="base extra"
)


def of_version(version: str, *lines: str) -> str:
    """A robot of a version, with its wrist."""
    return robot(*lines, WRIST).replace("name='r'", f"name='r' version='{version}'")


def drawn(shape: str = '<sphere radius="1"/>', *, part: str = "visual", version: str = "1.2") -> str:
    """A robot whose link `extra` is drawn as a shape."""
    end = part.removeprefix("@")
    link = f'<link name="extra"><{part}><geometry>{shape}</geometry></{end}></link>'
    return of_version(version, joint(), link + joint(name="extra", type="fixed", ends="base extra"))


BROKEN: dict[str, str] = {
    "an open element": "<robot>\n<link name='a'>\n</@robot>",
    "an empty file": "@",
    "a DOCTYPE": "<!DOCTYPE r @[<!ENTITY a SYSTEM '/etc/passwd'>]>\n<robot>&a;</robot>",
    "an entity": "<robot>\n@&secret;</robot>",
    "a world": "<@sdf/>",
    "xacro": robot('<@xacro:include filename="a.xacro"/>'),
    "no link": "<@robot name='r'/>",
    "a link without a name": robot(joint(), WRIST, "<@link/>"),
    "two links of a name": robot(joint(), WRIST, '<link name="@arm"/>'),
    "two joints of a name": robot(joint(), joint(name="@elbow", ends="arm hand")),
    "a joint without a type": robot('<@joint name="elbow"><parent link="base"/><child link="arm"/></joint>', WRIST),
    "an unknown type": robot(joint(type="@revolut"), WRIST),
    "no parent": robot('<@joint name="elbow" type="fixed"><child link="arm"/></joint>', WRIST),
    "an unknown parent": robot(joint(ends="@bse arm"), WRIST),
    "an unknown child": robot(joint(), joint(name="wrist", ends="arm @hnd")),
    "two parents": robot(joint(), WRIST, joint(name="@other", ends="base hand")),
    "a loop": robot(joint(name="@a", ends="hand arm"), WRIST),
    "two roots": robot(joint(), links="base arm").replace("</robot>", '<link name="@hand"/></robot>'),
    "no limits": robot(joint(type="@revolute"), WRIST),
    "limits in disorder": robot(joint('<limit lower="@1" upper="-1"/>', type="prismatic"), WRIST),
    "an axis of no length": robot(joint('<axis xyz="@0 0 0"/>'), WRIST),
    "two numbers": robot(joint('<origin xyz="@0 1"/>'), WRIST),
    "a number that is none": robot(joint('<origin xyz="0 0 0" rpy="@0 zero 0"/>'), WRIST),
    "an infinite number": robot(joint('<axis xyz="@0 0 inf"/>'), WRIST),
    "an expression": robot(joint('<origin xyz="@0 0 ${h}"/>'), WRIST),
    "an unknown joint to mimic": robot(joint(), joint('<mimic joint="@elbw"/>', name="wrist", ends="arm hand")),
    "a fixed joint to mimic": robot(
        joint(type="fixed"), joint('<mimic joint="@elbow"/>', name="wrist", ends="arm hand")
    ),
    "joints that mimic each other": robot(
        joint('<mimic joint="wrist"/>'), joint('<mimic joint="@elbow"/>', name="wrist", ends="arm hand")
    ),
    "a chain of mimics": robot(
        joint(name="j0", ends="l0 l1"),
        *(
            joint(f'<mimic joint="{"@" if n == MOST_MIMICS else ""}j{n - 1}"/>', name=f"j{n}", ends=f"l{n} l{n + 1}")
            for n in range(1, MOST_MIMICS + 1)
        ),
        links=" ".join(f"l{n}" for n in range(MOST_MIMICS + 2)),
    ),
    "too many links": robot(*(f'<link name="l{n}"/>' for n in range(MOST_PARTS)), '<@link name="more"/>', links=""),
    "an unknown version": robot(joint(), WRIST).replace("name='r'", "name='r' version='@1.3'"),
    "a version without a dot": robot(joint(), WRIST).replace("name='r'", "name='r' version='@1'"),
    "a quaternion before version 1.1": robot(joint('<origin quat_xyzw="@0 0 1 0"/>'), WRIST),
    "a capsule before version 1.1": drawn('<@capsule radius="1" length="1"/>', version="1.0"),
    "two rotations": of_version("1.1", joint('<origin rpy="0 0 1" quat_xyzw="@0 0 1 0"/>')),
    "three numbers of a quaternion": of_version("1.1", joint('<origin quat_xyzw="@0 0 1"/>')),
    "a quaternion of zeros": of_version("1.2", joint('<origin quat_xyzw="@0 0 0 0"/>')),
    "an unknown attribute of an origin": robot(joint('<origin quat="@0 0 1 0"/>'), WRIST),
    "an unknown attribute of an axis": robot(joint('<axis xyz="1 0 0" xzy="@0 0 1"/>'), WRIST),
    "an unknown attribute of a mimic": robot(
        joint(), joint('<mimic joint="elbow" ofset="@1"/>', name="wrist", ends="arm hand")
    ),
    "an unknown element of a joint": robot(joint("<@orgin xyz='1 0 0'/>"), WRIST),
    "an element of another language": robot(joint("<@pose/>"), WRIST),
    "an element in an origin": robot(joint("<origin><@xyz/></origin>"), WRIST),
    "an origin of a link": robot(
        joint(), '<link name="x"><@origin xyz="0 0 1"/></link>' + joint(name="x", ends="arm x")
    ).replace('<link name="hand"/>', ""),
    "two origins": robot(joint('<origin xyz="0 0 1"/><@origin xyz="0 0 2"/>'), WRIST),
    "an axis without numbers": robot(joint("<@axis/>"), WRIST),
    "digits of another script": robot(joint('<origin xyz="@0 0 ١"/>'), WRIST),
    "an unknown element of a link": drawn(part="@visul"),
    "an unknown shape": drawn('<@capsul radius="1" length="1"/>'),
    "no shape": drawn("").replace("<geometry>", "<@geometry>"),
    "two shapes": drawn('<sphere radius="1"/><box size="1 1 1"/>').replace("<geometry>", "<@geometry>"),
    "an unknown attribute of a shape": drawn('<box size="1 1 1" sise="@2 2 2"/>'),
    "a shape without numbers": drawn("<@box/>"),
    "a size of two numbers": drawn('<box size="@1 1"/>'),
    "a radius below 0": drawn('<sphere radius="@-1"/>'),
    "a scale that is none": drawn('<mesh filename="package://lab/arm.stl" scale="@1 x 1"/>'),
    "jerk below 0": of_version("1.2", joint('<limit jerk="@-1"/>')),
    "a limit that is missing": of_version("1.2", joint('<@limit lower="0"/>', type="revolute")),
    "too many levels": "<robot>\n" + "<a>" * (MOST_DEPTH - 1) + "@<a/>",
}

DOUBTFUL: dict[str, str] = {
    "a mesh that is not there": robot(joint(), WRIST, MESH.format("@package://lab/forearm.stl")),
    "an unknown package": robot(joint(), WRIST, MESH.format("@package://labb/arm.stl")),
    "a mesh outside of its package": robot(joint(), WRIST, MESH.format("@package://lab/../robot.urdf")),
    "a mesh of no package": robot(joint(), WRIST, MESH.format("@meshes/arm.stl")),
    "a file that is not there": robot(joint(), WRIST, MESH.format("@file:///nowhere/arm.stl")),
    "the same package of several meshes": robot(
        joint(),
        WRIST,
        MESH.format("@package://labb/arm.stl"),
        MESH.format("package://labb/b.stl").replace("extra", "b"),
    ),
    "jerk before version 1.2": robot(joint('<limit effort="1" velocity="1" jerk="@2"/>'), WRIST),
    "an unknown attribute of a limit": robot(joint('<limit current="@10"/>'), WRIST),
    "zeros of an axis": robot(joint('<axis xyz="0 0 1" rpy="@0 0 0"/>'), WRIST),
    "a macro that xacro did not know": robot(joint(), WRIST, '<@xacro:sensors parent="arm"/>'),
    "an unknown element of a visual": drawn().replace("<geometry>", "<@bullet/><geometry>"),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "lab.yaml").write_text(LAUNCH)
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/arm.stl").write_bytes(b"solid")
    return tmp_path


def problems(folder: Path, text: str | bytes) -> list[Problem]:
    """What is found before the start of a launch file that names this description."""
    (folder / "robot.urdf").write_bytes(text.encode() if isinstance(text, str) else text)
    return Graph([load(folder / "lab.yaml")]).plan().errors


@pytest.mark.parametrize("marked", BROKEN.values(), ids=BROKEN)
def test_mistake_is_found_at_its_place(folder: Path, marked: str, golden: Golden):
    before = marked.partition("@")[0]
    (problem,) = problems(folder, marked.replace("@", "", 1))
    assert problem.place is not None
    assert (problem.place.line, problem.place.column) == (before.count("\n") + 1, len(before.rpartition("\n")[2]) + 1)
    assert problem.place.file == str(folder / "robot.urdf")
    assert [str(each) for each in problem.included_from] == [f"{folder / 'lab.yaml'}:4:31"]
    golden(problem.render())


@pytest.mark.parametrize("marked", DOUBTFUL.values(), ids=DOUBTFUL)
def test_doubt_is_a_warning_at_its_place_and_an_error_if_strict(folder: Path, marked: str, golden: Golden):
    before = marked.partition("@")[0]
    (folder / "robot.urdf").write_text(marked.replace("@", "", 1))
    plan = Graph([load(folder / "lab.yaml")]).plan()
    (doubt,) = [each for each in plan.problems if each.severity is Severity.WARNING and each.code != "nobody-publishes"]
    assert doubt.place is not None
    assert (doubt.place.line, doubt.place.column) == (before.count("\n") + 1, len(before.rpartition("\n")[2]) + 1)
    assert plan.errors == []
    golden(doubt.render())
    strict = Graph([load(folder / "lab.yaml")], strict=True).plan()
    assert [each.code for each in strict.errors if each.code != "nobody-publishes"] == [doubt.code]


def test_all_mistakes_of_a_file_are_found_together(folder: Path):
    text = robot(joint('<origin xyz="0"/><axis xyz="0 0 0"/>', type="revolute"), WRIST, drawn("<box/>"))
    assert [each.code for each in problems(folder, text)] == ["bad-number", "no-axis", "no-limit"]
    many = robot(*('<joint name="x" type="?"/>' for _ in range(2 * MOST_PROBLEMS)))
    assert len(problems(folder, many)) == MOST_PROBLEMS


@pytest.mark.parametrize(
    ("content", "line", "column"),
    [
        (b"<robot>\n <link name='\xff'/>\n</robot>", 2, 14),
        (b"<robot>" + b" " * MOST_BYTES + b"</robot>", 1, 1),
    ],
    ids=["not UTF-8", "too large"],
)
def test_file_is_refused_as_a_whole(folder: Path, content: bytes, line: int, column: int, golden: Golden):
    (problem,) = problems(folder, content)
    assert problem.place is not None
    assert (problem.place.line, problem.place.column) == (line, column)
    golden(problem.render())


def test_missing_file_is_named_where_it_is_stated(folder: Path):
    (problem,) = Graph([load(folder / "lab.yaml")]).plan().errors
    assert (problem.code, str(folder / "robot.urdf") in problem.message) == ("unreadable-file", True)
    assert str(problem.place) == f"{folder / 'lab.yaml'}:4:31"


def test_what_simulators_read_is_left_alone(folder: Path):
    transmission = (
        '<transmission name="t"><joint name="elbow"/><joint name="elbow"/><mesh filename="x"/></transmission>'
    )
    text = robot(joint(), WRIST, transmission, '<gazebo reference="arm"><link name="arm"/></gazebo>')
    assert problems(folder, text.replace("'r'", "'r' xmlns:xacro='http://www.ros.org/wiki/xacro'")) == []


@pytest.mark.parametrize(
    "inside",
    [
        '<controller_gains kp="1"/><joint_properties damping="0.1"/><drake:rotor_inertia value="1"/>',
        '<axis xyz="0 0 0"/>',  # of a joint that does not move, as exporters write it
        '<origin xyz="0 0 1" drake:frame="x"/>',
        '<origin xyz="0 0 1"/><origin xyz="0 0 1"/>',
    ],
)
def test_what_others_put_into_joints_and_links_is_left_alone(folder: Path, inside: str):
    shape = '<visual group="a"><geometry name="b"><sphere radius="0"/></geometry></visual>'
    link = f'<link name="tip"><contact/>{shape}</link>'
    text = robot(joint(inside, type="fixed"), WRIST, link, joint(name="tip", type="fixed", ends="hand tip"))
    text = text.replace("'r'", "'r' xmlns:drake='http://drake.mit.edu'")
    (folder / "robot.urdf").write_text(text)
    found = Graph([load(folder / "lab.yaml")]).plan().problems
    assert [each for each in found if each.severity is not Severity.INFO and each.code != "nobody-publishes"] == []


@pytest.mark.parametrize("version", ["1.1", "1.2"])
@pytest.mark.parametrize("scale", [1, 2.5, -1, 1e-200, 1e308])
def test_rotation_is_read_from_a_quaternion(folder: Path, version: str, scale: float):
    """Of any length, as urdfdom reads it; the same rotation as angles say."""
    file = folder / "robot.urdf"
    x, y, z, w = from_rpy(0.3, -0.4, 1.2)
    stated = " ".join(repr(each * scale) for each in (x, y, z, w))
    file.write_text(of_version(version, joint(f'<origin xyz="1 2 3" quat_xyzw="{stated}"/>', type="fixed")))
    found = read_robot(file, {}).joints[0].origin
    sign = -1 if scale < 0 else 1
    assert found == pytest.approx((1, 2, 3, sign * x, sign * y, sign * z, sign * w))


def test_capsules_and_limits_of_motion_are_read(folder: Path):
    limit = '<limit lower="0" upper="1" acceleration="10" deceleration="5" jerk="200"/>'
    assert problems(folder, of_version("1.2", joint(limit, type="prismatic"))) == []
    assert problems(folder, drawn('<capsule radius="0.1" length="0.5"/>', part="collision", version="1.1")) == []


def test_web_address_and_whole_path_will_do(folder: Path):
    meshes = ["https://example.org/arm.stl", f"file://{folder}/meshes/arm.stl", "package://lab/arm.stl"]
    parts = [MESH.format(mesh).replace("extra", f"extra{number}") for number, mesh in enumerate(meshes)]
    assert problems(folder, robot(joint(), WRIST, *parts)) == []


def test_robot_is_read_with_its_tree_and_axes(folder: Path):
    file = folder / "robot.urdf"
    slides = '<origin xyz="1 2 3"/><axis xyz="0 0 2"/><limit lower="-1" upper="1"/>'
    file.write_text(robot(joint(slides, type="prismatic"), WRIST))
    found = read_robot(file, {})
    elbow, wrist = found.joints
    assert (found.name, found.root, found.text) == ("r", "base", file.read_text())
    assert (elbow.kind, elbow.parent, elbow.child, elbow.axis) == (JointKind.PRISMATIC, "base", "arm", (0.0, 0.0, 1.0))
    assert elbow.motion(0.5) == (1.0, 2.0, 3.5, 0.0, 0.0, 0.0, 1.0)
    assert (wrist.kind, wrist.origin, wrist.source) == (JointKind.FIXED, (0, 0, 0, 0, 0, 0, 1), "wrist")


def test_joint_that_mimics_a_mimic_follows_first(folder: Path):
    file = folder / "robot.urdf"
    file.write_text(
        robot(
            joint(),
            joint('<mimic joint="elbow" multiplier="2" offset="0.5"/>', name="wrist", ends="arm hand"),
            joint('<mimic joint="wrist" multiplier="-3" offset="0.25"/>', name="finger", ends="hand tip"),
            links="base arm hand tip",
        )
    )
    finger = read_robot(file, {}).joints[2]
    assert (finger.source, finger.multiplier, finger.offset) == ("elbow", -6.0, -1.25)


# Files in packages.


@pytest.mark.parametrize(
    "address",
    [
        "package://lab/arm.stl",
        "package://lab/./arm.stl",
        "package://lab/parts/../arm.stl",
        "package://lab/parts/link.stl",
        "package://lab/%61rm.stl",
    ],
)
def test_file_of_a_package_is_found(folder: Path, address: str):
    (folder / "meshes/parts").mkdir()
    (folder / "meshes/parts/link.stl").symlink_to("../arm.stl")
    assert package_file(address, {"lab": folder / "meshes"}) == (folder / "meshes/arm.stl").resolve()


@pytest.mark.parametrize(
    "address",
    [
        "package://lab/../robot.urdf",
        "package://lab/%2e%2e/robot.urdf",
        "package://lab//etc/hostname",
        "package://lab/../nothing",
        "package://lab/outside.stl",
        "package://lab/beside/secret.stl",
        "package://lab/",
        "package://lab/pipe.stl",
        "package://lab/a\x00b",
        "package://lab/loop.stl",
        "package://lab",
        "package://../lab/arm.stl",
        "package:///etc/passwd",
        "file:///etc/passwd",
        "/etc/passwd",
    ],
)
def test_address_that_leads_elsewhere_is_refused(folder: Path, address: str, golden: Golden):
    import os

    meshes = folder / "meshes"
    (folder / "robot.urdf").write_text("")
    (folder / "meshes2").mkdir()
    (folder / "meshes2/secret.stl").write_text("")
    (meshes / "outside.stl").symlink_to("../robot.urdf")
    (meshes / "beside").symlink_to("../meshes2")
    (meshes / "loop.stl").symlink_to("loop.stl")
    os.mkfifo(meshes / "pipe.stl")
    with golden.raises(NoSuchTarget):
        package_file(address, {"lab": meshes})


def test_folder_that_is_a_link_is_followed(folder: Path):
    (folder / "linked").symlink_to("meshes")
    assert package_file("package://lab/arm.stl", {"lab": folder / "linked"}) == (folder / "meshes/arm.stl").resolve()


def test_mistakes_raise_one_error_with_all(folder: Path):
    (folder / "robot.urdf").write_text("<robot/>")
    with pytest.raises(LaunchError) as refused:
        read_robot(folder / "robot.urdf", {})
    assert [each.code for each in refused.value.problems] == ["no-link"]
