"""`frames:` of a launch file: every mistake is found before the start, at its place."""

from __future__ import annotations

import pytest

from busflow import Graph
from busflow.errors import LaunchError
from busflow.launchfile.load.load import load


def problems(tmp_path, text):
    file = tmp_path / "lab.yaml"
    file.write_text(text)
    try:
        found = Graph([load(file)]).plan().errors
    except LaunchError as error:
        found = error.problems
    return [(each.place.line, each.place.column, each.message) for each in found]


@pytest.mark.parametrize(
    ("frames", "line", "column", "message"),
    [
        ("{a: {b: {xyz: [0, 1]}}}", 1, 23, "xyz must have at least 3 items, has 2"),
        ("{a: {b: {xyz: [0, 1, .nan]}}}", 1, 30, "xyz[2] must be a finite number, got .nan"),
        ("{a: {b: {xyz: [0, 1, x]}}}", 1, 30, "frames.a.b.xyz[2] must be a number, got text 'x'"),
        ("{a: {b: {rpy: [0, 1, 2, 3]}}}", 1, 23, "rpy must have at most 3 items, has 4"),
        ("{a: {b: {rpz: [0, 1, 2]}}}", 1, 18, "unknown key frames.a.b.rpz"),
        ("{a: {b: {quaternion: [0, 0, 0, 0]}}}", 1, 14, "a quaternion has the length 1, and this one 0; write rpy"),
        ("{a: {b: {quaternion: [0, 0, 1]}}}", 1, 30, "quaternion must have at least 4 items, has 3"),
        ("{a: {b: {rpy: [0, 0, 0], quaternion: [0, 0, 0, 1]}}}", 1, 14, "as rpy or as quaternion, not as both"),
        ("{a: {b: {}}, c: {b: {}}}", 1, 26, "the frame b has two parents, a and c"),
        ("{a: {b: {}}, b: {a: {}}}", 1, 26, "b → a closes a loop of frames: a → b → a"),
        ("{a: {a: {}}}", 1, 14, "a → a closes a loop of frames: a → a"),
        ("{a: {b: {}}, b: {c: {}}, c: {a: {}}}", 1, 38, "c → a closes a loop of frames: a → b → c → a"),
    ],
)
def test_each_mistake_is_found_at_its_place(tmp_path, frames, line, column, message):
    ((at_line, at_column, text),) = problems(tmp_path, f"frames: {frames}\n")
    assert (at_line, at_column) == (line, column)
    assert message in text
