"""Tests of `errors.py`: the text and the JSON of problems, and the exceptions that collect faults."""

from __future__ import annotations

import pytest

from busflow.errors import BagError, Fault, InvalidParameter, LaunchError, Place, PluginError, Problem, Severity

PLACE = Place("lab.yaml", 3, 5, 4, "    rate: x")


def test_problem_shows_place_line_caret_and_fix():
    problem = Problem("unknown-key", "unknown key rate", "did you mean 'rate_hz'?", PLACE)
    assert problem.render().splitlines() == [
        "lab.yaml:3:5: error: unknown key rate",
        "      rate: x",
        "      ^^^^",
        "  fix: did you mean 'rate_hz'?",
    ]


def test_known_words_are_shown_without_fix():
    warning = Problem("a", "b", "known: c", severity=Severity.WARNING, included_from=(Place("main.yaml", 1, 1),))
    assert warning.render().splitlines() == ["warning: b", "  known: c", "  included from main.yaml:1:1"]


def test_long_line_is_cut_around_the_caret():
    place = Place("lab.yaml", 1, 301, 3, "a" * 300 + "bad" + "c" * 300)
    _, line, caret = Problem("a", "b", None, place).render().splitlines()
    assert len(line) == 162
    assert line[caret.index("^") :].startswith("bad")
    assert caret.count("^") == 3


def test_json_has_the_fields_of_a_problem():
    found = Problem("a", "b", "c", PLACE, included_from=(Place("main.yaml", 1, 2),), details=("d",)).as_json()
    assert found == {
        "code": "a",
        "severity": "error",
        "message": "b",
        "fix": "c",
        "file": "lab.yaml",
        "line": 3,
        "column": 5,
        "included_from": ["main.yaml:1:2"],
        "details": ["d"],
    }
    assert Problem("a", "b").as_json()["file"] is None


def test_json_cuts_names_of_a_megabyte():
    found = Problem("a", "x" * 1_000_000, "\x1b" * 1_000_000).as_json()
    assert all(len(str(value)) < 20_000 for value in found.values())
    assert "\x1b" not in str(found["fix"])


def test_errors_list_all_their_faults():
    assert str(InvalidParameter([Fault(("a",), "a is wrong", "leave it out"), Fault(("b",), "b\x1b")])) == (
        "a is wrong (leave it out); b\\x1b"
    )
    problems = [Problem("a", "one"), Problem("b", "two")]
    assert str(LaunchError(problems)) == "error: one\nerror: two"
    assert str(PluginError(problems[0])) == "error: one"


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({}, "damaged"),
        ({"file": "a.mcap"}, "a.mcap: damaged"),
        ({"file": "a.mcap", "offset": 0, "fix": "recover it"}, "a.mcap: at byte 0: damaged; recover it"),
    ],
)
def test_bag_error_names_file_and_offset(given, text):
    assert str(BagError("damaged", **given)) == text
