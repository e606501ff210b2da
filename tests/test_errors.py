"""Tests of `errors.py`: the text and the JSON of problems, and the exceptions that collect faults."""

from __future__ import annotations

import json

import pytest

from busflow.cli import main
from busflow.errors import (
    BagError,
    ExitCode,
    Fault,
    InvalidParameter,
    LaunchError,
    Place,
    PluginError,
    Problem,
    ServiceError,
    Severity,
)

PLACE = Place("lab.yaml", 3, 5, 4, "    rate: x")


def test_problem_shows_place_line_caret_and_fix(golden):
    problem = Problem("unknown-key", "unknown key rate", "did you mean 'rate_hz'?", PLACE)
    golden(problem.render())


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


def test_errors_list_all_their_faults(golden):
    golden(str(InvalidParameter([Fault(("a",), "a is wrong", "leave it out"), Fault(("b",), "b\x1b")])))
    problems = [Problem("a", "one"), Problem("b", "two")]
    assert str(LaunchError(problems)) == "error: one\nerror: two"
    assert str(PluginError(problems[0])) == "error: one"


@pytest.mark.parametrize(
    ("command", "code", "problems"),
    [
        ("config configs/lab1.yaml bad:=1 --json", "launch-error", ["unknown-argument"]),
        ("plugins info nosuch --json", "unknown-plugin", None),
        ("bag info nosuch.mcap --json", "bag-error", None),
    ],
)
def test_json_of_a_failed_command_has_the_code(command, code, problems, capsys):
    assert main(command.split()) == ExitCode.USAGE
    out, err = capsys.readouterr()
    error = json.loads(out)["error"]
    assert error["code"] == code
    assert [each["code"] for each in error.get("problems", ())] == (problems or [])
    assert error["message"].splitlines()[0] in err


def test_json_of_faults_has_their_codes():
    error = InvalidParameter([Fault(("a", 1), "a[1] is wrong", "leave it out", "range")]).as_json()
    assert error["code"] == "invalid-parameter"
    assert error["faults"] == [{"path": ("a", 1), "message": "a[1] is wrong", "fix": "leave it out", "code": "range"}]


def test_subclass_may_state_its_code():
    class Late(ServiceError): ...

    class Mine(Late):
        code = "of-mine"

    assert (Late.code, Mine.code, type("Other", (Mine,), {}).code) == ("late", "of-mine", "other")


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
