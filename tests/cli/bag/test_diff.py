import shutil
from pathlib import Path

import pytest

from busflow.cli import main
from tests.recording.conftest import write_numbers

BAGS = Path(__file__).parents[2] / "cases/rosbag2"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """A folder with recordings of numbers, named by how many there are, and one of other numbers."""
    monkeypatch.chdir(tmp_path)
    for name, count, first in (("none", 0, 0), ("one", 1, 0), ("other", 1, 7), ("two", 2, 0), ("nine", 9, 0)):
        write_numbers(tmp_path / f"{name}.mcap", count, first=first)
    shutil.copy(BAGS / "talker/talker.mcap", tmp_path)


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("talker.mcap talker.mcap", 0),
        ("two.mcap nine.mcap", 3),
        ("talker.mcap two.mcap --topics topic", 3),
        ("talker.mcap two.mcap --topics topicc", 4),
        ("one.mcap other.mcap", 3),
        ("one.mcap other.mcap --tolerance 7", 0),
        ("one.mcap two.mcap", 3),
        ("none.mcap none.mcap", 0),
    ],
)
def test_output(shell, line, code):
    assert shell(f"bag diff {line}") == code


def test_storage_format_makes_no_difference():
    assert main(["bag", "convert", str(BAGS / "talker"), "copy", "--to", "mcap"]) == 0
    assert main(["bag", "diff", str(BAGS / "talker"), "copy", "--times"]) == 0


def test_json_reports_the_same_differences(tmp_path, shell):
    answer = shell.data(f"bag diff talker.mcap {BAGS}/talker")
    assert (answer["version"], answer["same"], answer["messages"]) == (1, True, 20)
    write_numbers(tmp_path / "three.mcap", 3)
    write_numbers(tmp_path / "others.mcap", 3, first=1)
    (topic,) = shell.data("bag diff three.mcap others.mcap --most 1", code=3)["topics"]
    assert (topic["name"], topic["different"], topic["messages"]) == ("/number", 3, [3, 3])
    assert topic["first"] == [{"number": 1, "since_start_ns": [0, 0], "fields": [{"path": "data", "a": 0.0, "b": 1.0}]}]


def test_truncated_recording_is_not_the_same(tmp_path, shell):
    whole = write_numbers(tmp_path / "a.mcap", 500).read_bytes()
    (tmp_path / "b.mcap").write_bytes(whole[:-300])
    assert main(["bag", "diff", "b.mcap", "b.mcap"]) == 0
    (tmp_path / "b.mcap").write_bytes(whole[: len(whole) // 2])
    assert shell("bag diff b.mcap b.mcap", mask={r"\d+ messages|at byte .*": "#"}) == 5
