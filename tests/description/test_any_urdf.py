"""Any URDF file is read to finite, rigid transforms, or refused at a place in it."""

from __future__ import annotations

import tempfile
from math import hypot, isfinite
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.description.robot import MOVES, Robot
from busflow.description.urdf import read_robot
from busflow.errors import LaunchError

_TAGS = [
    "robot",
    "link",
    "joint",
    "origin",
    "parent",
    "child",
    "axis",
    "limit",
    "mimic",
    "visual",
    "collision",
    "inertial",
    "geometry",
    "box",
    "sphere",
    "cylinder",
    "capsule",
    "mesh",
    "material",
    "texture",
    "orgin",
    "Origin",
    "pose",
    "gazebo",
    "transmission",
    "drake:joint",
    "contact",
    "xacro:macro",
]
_NAMES = [
    "name",
    "type",
    "link",
    "xyz",
    "rpy",
    "quat_xyzw",
    "joint",
    "multiplier",
    "offset",
    "lower",
    "upper",
    "jerk",
    "effort",
    "size",
    "radius",
    "length",
    "scale",
]
_numbers = st.one_of(
    st.sampled_from(
        [
            "0",
            "1",
            "-1",
            "1.5",
            "nan",
            "inf",
            "-inf",
            "1e308",
            "-1e308",
            "5e-324",
            "-0",
            "+1",
            "1_0",
            "١",
            "${x}",
            "x",
            "0x1",
        ]
    ),
    st.floats().map(repr),
)
_values = st.one_of(
    st.sampled_from(
        [
            "a",
            "b",
            "c",
            "revolute",
            "fixed",
            "prismatic",
            "continuous",
            "planar",
            "floating",
            "1.0",
            "1.1",
            "1.2",
            "1.3",
            "package://lab/a",
        ]
    ),
    st.lists(_numbers, max_size=5).map(" ".join),
    st.text(st.sampled_from("ab/:. é\n\t0"), max_size=5),
)
_attributes = st.dictionaries(st.sampled_from([*_NAMES, "filename", "version", "quat", "drake:a"]), _values, max_size=3)


def _element(inside: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    def written(tag: str, attributes: dict[str, str], children: list[str]) -> str:
        stated = "".join(f' {name}="{value}"' for name, value in attributes.items())
        return f"<{tag}{stated}>{''.join(children)}</{tag}>"

    return st.builds(written, st.sampled_from(_TAGS), _attributes, st.lists(inside, max_size=3))


_anything = st.recursive(st.just(""), _element, max_leaves=12)


@st.composite
def robots(draw: st.DrawFn) -> str:
    """A tree of links whose joints have each element that may move them, right ones and wrong ones."""
    careful = draw(st.booleans())
    number = st.floats(-10, 10).map(repr) if careful else _numbers
    version = draw(st.sampled_from([' version="1.1"', ' version="1.2"'] + ([] if careful else ["", ' version="1.0"'])))
    lines = ['<link name="l0"/>']
    for count in range(1, draw(st.integers(1, 4)) + 1):
        kind = draw(st.sampled_from(["fixed", "revolute", "continuous", "prismatic", "floating", "planar"]))
        xyz, axis, angles = (draw(st.lists(number, min_size=3, max_size=3).map(" ".join)) for _ in range(3))
        quaternion = draw(st.lists(number, min_size=4 if careful else 3, max_size=4).map(" ".join))
        turn = draw(st.sampled_from(["", f' rpy="{angles}"', f' quat_xyzw="{quaternion}"']))
        limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>' if careful or draw(st.booleans()) else ""
        mimic = "" if careful else f'<mimic joint="j{draw(st.integers(0, 5))}" offset="{draw(_numbers)}"/>'
        ends = f'<parent link="l{draw(st.integers(0, count - 1))}"/><child link="l{count}"/>'
        others = "" if careful else draw(_anything)
        inside = f'<origin xyz="{xyz}"{turn}/><axis xyz="{axis}"/>{ends}{limit}{mimic}{others}'
        lines += [
            f'<link name="l{count}">{others}</link>',
            f'<joint name="j{count}" type="{kind}">{inside}</joint>',
        ]
    return "\n".join([f'<robot name="r" xmlns:drake="d"{version}>', *draw(st.permutations(lines)), "</robot>"])


def read(text: str) -> Robot | None:
    """Read a file; check that what is refused or doubted has its place in it."""
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "robot.urdf"
        file.write_text(text, "utf-8")
        found, problems = None, list[object]()
        try:
            found = read_robot(file, {})
        except LaunchError as error:
            problems = [*error.problems]
        for each in [*problems, *(found.doubts if found else ())]:
            assert each.place.file == str(file)
            assert 1 <= each.place.line <= text.count("\n") + 1
            assert each.place.excerpt in text
    return found


@given(robots())
def test_robot_moves_rigidly_or_is_refused(text):
    robot = read(text)
    for joint in robot.joints if robot else ():
        for position in (0.0, 1.0) if joint.kind in MOVES else ():
            motion = joint.motion(position)
            assert hypot(*motion[3:]) == pytest.approx(1)
        assert all(map(isfinite, joint.origin))
        assert hypot(*joint.origin[3:]) == pytest.approx(1)
        assert hypot(*joint.axis) == pytest.approx(1)


@given(_anything)
def test_any_elements_are_read_or_refused(text):
    read(text)
    read(f'<robot name="r"><link name="a"/>{text}</robot>')


@given(robots(), st.data())
def test_any_change_of_a_file_is_read_or_refused(text, data):
    at = data.draw(st.integers(0, len(text)))
    changed = data.draw(st.text(st.sampled_from("<>/\"'=& a1\n\0é"), max_size=3))
    read(text[:at] + changed + text[at + data.draw(st.integers(0, 8)) :])
