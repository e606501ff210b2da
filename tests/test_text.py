"""Tests of `text.py`: safe text for terminals, and suggestions for misspelt words."""

from __future__ import annotations

import pytest

from busflow.text import UNSAFE, counted, did_you_mean, nearest, plain, printable


@pytest.mark.parametrize("char", ["\n", "\x1b", "\x9b", "\u2028", "\u202e", "\ud800"])
def test_control_characters_are_escaped(char):
    shown = printable(f"a{char}b")
    assert not UNSAFE.search(shown)
    assert shown.startswith("a\\")
    assert shown.encode()


def test_text_beyond_the_limit_is_cut():
    assert printable("x" * 10, limit=10) == "x" * 10
    assert printable("x" * 11, limit=10) == "x" * 9 + "…"


def test_nested_values_are_shown_to_a_depth():
    assert plain({"a": [{"b": ("c",)}]}) == "{a: [{b: [c]}]}"
    assert plain([["a"]], depth=1) == "[['a']]"
    assert plain(list(range(1000))) == plain(list(range(200)))


def test_count_takes_the_matching_noun():
    assert [counted(count, "drop") for count in (0, 1, 2)] == ["0 drops", "1 drop", "2 drops"]
    assert counted(2, "entry", "entries") == "2 entries"


def test_nearest_prefers_case_then_last_part_then_spelling():
    assert nearest("IMU", ["imu", "imuu"]) == "imu"
    assert nearest("data", ["/imu/data", "/date"]) == "/imu/data"
    assert nearest("data", ["/left_shoulder_imu/data", "/front_receiver/data"]) is None, "either could be meant"
    assert nearest("rat_hz", ["rate_hz", "noise"]) == "rate_hz"
    assert nearest("zzz", ["rate_hz", "noise"]) is None
    assert nearest("/knee/target", ["/knee/effort", "/knee/angle"]) is None, "only the namespace is alike"
    assert nearest("/knee/efort", ["/knee/effort", "/knee/angle"]) == "/knee/effort"
    assert nearest("/kne/effort", ["/knee/effort", "/arm/effort"]) == "/knee/effort"
    assert nearest("nope.yaml", ["humanoid.yaml"]) is None


def test_advice_lists_the_first_known_words():
    assert did_you_mean("zzz", "abcd", show=3) == "known: a, b, c … and 1 more"
    assert did_you_mean("zz\x1b", ["zz\x1bz"]) == "did you mean 'zz\\\\x1bz'?"
