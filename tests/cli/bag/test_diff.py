import json
import shutil
from pathlib import Path

import pytest

from busflow.cli import main
from tests.recording.conftest import write_numbers

BAGS = Path(__file__).parents[2] / "cases/rosbag2"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_storage_format_makes_no_difference(capsys):
    assert main(["bag", "diff", str(BAGS / "talker"), str(BAGS / "talker")]) == 0
    assert capsys.readouterr().out == "the same: 20 messages were compared (topics: 3)\n"
    assert main(["bag", "convert", str(BAGS / "talker"), "copy", "--to", "mcap"]) == 0
    assert main(["bag", "diff", str(BAGS / "talker"), "copy", "--times"]) == 0


def test_differences_are_shown_with_field_and_values(tmp_path, capsys):
    write_numbers(tmp_path / "a.mcap", 10)
    write_numbers(tmp_path / "b.mcap", 9, topic="/number")
    assert main(["bag", "diff", "a.mcap", "b.mcap"]) == 3
    assert capsys.readouterr().out == (
        "/number has 10 messages in a.mcap, 9 in b.mcap\ndifferent: 9 messages were compared (topics: 1)\n"
    )
    shutil.copy(BAGS / "talker/talker.mcap", "c.mcap")
    assert main(["bag", "diff", "c.mcap", "a.mcap", "--topics", "topic"]) == 3
    assert capsys.readouterr().out.startswith("/topic is not in a.mcap\n")
    assert main(["bag", "diff", "c.mcap", "a.mcap", "--topics", "topicc"]) == 4


def test_zero_and_one_message_are_counted_correctly(tmp_path, capsys):
    for name, count, first in (("one", 1, 0), ("other", 1, 7), ("none", 0, 0), ("two", 2, 0)):
        write_numbers(tmp_path / f"{name}.mcap", count, first=first)
    assert main(["bag", "diff", "one.mcap", "other.mcap"]) == 3
    differing = "  message 1, at 0.000 s\n    data: 0.0 -> 7.0\n"
    assert capsys.readouterr().out == (
        f"/number: its message differs\n{differing}different: 1 message was compared (topics: 1)\n"
    )
    assert main(["bag", "diff", "one.mcap", "two.mcap"]) == 3
    assert capsys.readouterr().out.startswith("/number has 1 message in one.mcap, 2 in two.mcap\n")
    assert main(["bag", "diff", "none.mcap", "none.mcap"]) == 0
    assert capsys.readouterr().out.startswith("the same: no messages were compared")


def test_json_reports_the_same_differences(tmp_path, capsys):
    shutil.copytree(BAGS / "talker", tmp_path / "a")
    assert main(["bag", "diff", "a", str(BAGS / "talker"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["version"], answer["same"], answer["messages"]) == (1, True, 20)
    write_numbers(tmp_path / "one.mcap", 3)
    write_numbers(tmp_path / "other.mcap", 3, first=1)
    assert main(["bag", "diff", "one.mcap", "other.mcap", "--json", "--most", "1"]) == 3
    (topic,) = json.loads(capsys.readouterr().out)["topics"]
    assert (topic["name"], topic["different"], topic["messages"]) == ("/number", 3, [3, 3])
    assert topic["first"] == [{"number": 1, "since_start_ns": [0, 0], "fields": [{"path": "data", "a": 0.0, "b": 1.0}]}]
    assert main(["bag", "diff", "one.mcap", "other.mcap", "--tolerance", "1"]) == 0


def test_truncated_recording_is_not_the_same(tmp_path, capsys):
    whole = write_numbers(tmp_path / "a.mcap", 500).read_bytes()
    (tmp_path / "b.mcap").write_bytes(whole[:-300])
    assert main(["bag", "diff", "b.mcap", "b.mcap"]) == 0
    (tmp_path / "b.mcap").write_bytes(whole[: len(whole) // 2])
    assert main(["bag", "diff", "b.mcap", "b.mcap"]) == 5
    assert capsys.readouterr().err.count("warning: b.mcap at byte ") == 2
