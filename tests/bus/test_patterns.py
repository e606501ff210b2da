"""Tests of `patterns.py`: the topics a selection includes, compared with ROS 2's recorder."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from busflow.bus.patterns import Selection, check_pattern
from busflow.errors import InvalidName
from tests.vectors import each_case

NAME = st.from_regex(r"/[a-z_]{1,3}(/[a-z]{1,3}){0,2}", fullmatch=True)


@each_case("l_replay_record", "filter/")
def test_what_ros2_s_recorder_selects(case):
    options = case["options"]
    excluded = [options["exclude_regex"]] if "exclude_regex" in options else []
    selection = Selection(options.get("topics", []), options.get("exclude_topics", []), exclude_regexes=excluded)
    there = [f"/{name.strip('/')}" for name in case["topics"]]
    assert [name for name in there if selection.includes(name)] == [f"/{name.strip('/')}" for name in case["expect"]]


@pytest.mark.parametrize(
    ("pattern", "meant", "not_meant"),
    [
        ("/imu/*", ["/imu/data", "/imu/raw"], ["/imu", "/imu/left/data", "/gps/imu/data"]),
        ("/imu/**", ["/imu/data", "/imu/left/data"], ["/imu", "/imus/data"]),
        ("/**", ["/a", "/a/b/c"], ["/_a", "/a/_b"]),
        ("/**/image_*", ["/left/image_raw", "/a/b/image_rect"], ["/image_raw", "/left/image"]),
        ("imu*", ["/imu", "/imu_2"], ["/imu/data"]),
        ("/_*", ["/_a"], ["/a/_b"]),
        ("/a/_b", ["/a/_b"], ["/a/_c"]),
        ("/*_state", ["/balance_state"], ["/state_of"]),
    ],
)
def test_pattern_selects_what_it_means(pattern, meant, not_meant):
    selection = Selection([pattern])
    assert [name for name in [*meant, *not_meant] if selection.includes(name)] == meant


def test_regular_expressions_match_anywhere_in_a_name():
    selection = Selection(["/gps"], ["/left/image/raw"], regexes=["image", "^/imu$"], exclude_regexes=["depth$"])
    names = ["/gps", "/left/image", "/imu", "/imu/data", "/left/image/depth", "/left/image/raw", "/_image", "/odom"]
    assert [name for name in names if selection.includes(name)] == ["/gps", "/left/image", "/imu"]
    assert selection.unmatched == ()
    assert Selection(regexes=["/_image"]).includes("/_image")
    assert Selection(regexes=["lidar"]).unmatched == ("lidar",)


@pytest.mark.parametrize("regex", ["(", "a{99999999999}"])
def test_wrong_regular_expression_is_refused(golden, regex):
    with golden.raises(InvalidName):
        Selection(exclude_regexes=[regex])


def tried(pattern, name):
    """Whether a pattern matches, by trying every place for each of its wildcards."""
    if not pattern:
        return not name
    if pattern.startswith("*"):
        deep = pattern.startswith("**")
        rest = pattern.removeprefix("**" if deep else "*")
        reach = len(name) if deep or "/" not in name else name.index("/")
        return any(tried(rest, name[place:]) for place in range(reach + 1))
    return name[:1] == pattern[0] and tried(pattern[1:], name[1:])


@given(
    st.from_regex(r"/[ab*]{1,4}(/[ab*]{1,4}){0,2}", fullmatch=True),
    st.from_regex(r"/[ab]{1,3}(/[ab]{1,3}){0,3}", fullmatch=True),
)
def test_wildcards_match_wherever_they_can(pattern, name):
    assume("***" not in pattern)
    assert Selection([pattern]).includes(name) is tried(pattern, name)


def test_many_wildcards_take_no_longer():
    selection = Selection(["/" + "**a" * 40 + "b", "/" + "*a" * 40 + "b"])
    assert not selection.includes("/" + "a" * 246)


@pytest.mark.parametrize("pattern", ["", "/", "//a", "/a/", "/a.b", "/a b", "/[ab]", "a?", "/***", "/1a", "/.*", "~/a"])
def test_what_is_no_pattern_is_refused(pattern):
    with pytest.raises(InvalidName):
        check_pattern(pattern)


def test_unmatched_lists_patterns_without_a_match():
    selection = Selection(["/a", "/b*", "/c"])
    assert [selection.includes(name) for name in ("/a", "/d", "/bee")] == [True, False, True]
    assert selection.unmatched == ("/c",)


@given(NAME)
def test_a_name_is_a_pattern_that_means_itself(name):
    assert Selection([name]).includes(name)
    assert not Selection([name]).includes(name + "x")
    assert not Selection([name], exclude=[name]).includes(name)
