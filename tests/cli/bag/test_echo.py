import json
import shutil
from pathlib import Path

import pytest

from busflow.cli import main

BAGS = Path(__file__).parents[2] / "cases/rosbag2"


@pytest.fixture
def talker(tmp_path, monkeypatch):
    """A bag that real ROS 2 recorded, in the current directory."""
    shutil.copytree(BAGS / "talker", tmp_path / "talker")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "talker"


pytestmark = pytest.mark.usefixtures("talker")


def lines(capsys):
    return capsys.readouterr().out.splitlines()


def test_messages_are_printed_as_yaml_in_their_order(capsys):
    assert main(["bag", "echo", "talker", "topic"]) == 0
    assert lines(capsys) == [line for number in range(10) for line in (f"data: Hello, world! {number}", "---")]


def test_the_forms_are_those_of_topic_echo(capsys):
    assert main(["bag", "echo", "talker", "topic", "--once", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer.pop("published_ns") // 10**9 == 1585866235
    assert answer == {"version": 1, "topic": "/topic", "sequence": None, "message": {"data": "Hello, world! 0"}}
    assert main(["bag", "echo", "talker", "/rosout", "--csv", "--field", "msg", "-n", "2"]) == 0
    assert lines(capsys) == ["\"Publishing: 'Hello, world! 0'\"", "\"Publishing: 'Hello, world! 1'\""]
    assert main(["bag", "echo", "talker", "topic", "--raw", "--once"]) == 0
    assert lines(capsys)[0].startswith(r"b'\x00\x01\x00\x00\x10")
    assert main(["bag", "echo", "talker", "topic", "--no-str", "--once"]) == 0
    assert lines(capsys)[0] == "data: '<string length: <15>>'"
    assert main(["bag", "echo", "talker", "topic", "--filter", "data == 'Hello, world! 7'"]) == 0
    assert lines(capsys) == ["data: Hello, world! 7", "---"]


def test_a_stretch_of_time_is_picked(capsys):
    assert main(["bag", "echo", "talker", "topic", "--start", "1s", "--end", "2.2s"]) == 0
    assert lines(capsys)[::2] == ["data: Hello, world! 2", "data: Hello, world! 3", "data: Hello, world! 4"]
    assert main(["bag", "echo", "talker", "topic", "--start", "0s", "--last", "1"]) == 0
    assert lines(capsys) == ["data: Hello, world! 9", "---"]


def test_start_beyond_the_end_is_refused(capsys):
    assert main(["bag", "echo", "talker", "topic", "--start", "100s"]) == 2
    assert "--start 100s is beyond the end: talker ends 4.5" in capsys.readouterr().err


def test_a_count_beyond_all_memory_is_refused(capsys):
    assert main(["bag", "echo", "talker", "topic", "--last", str(10**20)]) == 2
    assert f"{10**20} is not in the range" in capsys.readouterr().err


def test_unknown_topic_gets_the_nearest_name(capsys):
    assert main(["bag", "echo", "talker", "topicc"]) == 4
    assert capsys.readouterr().err == "error: talker: there is no topic topicc in it; did you mean '/topic'?\n"


def test_unknown_field_is_shown_with_a_caret(capsys):
    assert main(["bag", "echo", "talker", "topic", "--field", "dat"]) == 2
    assert "did you mean 'data'?" in capsys.readouterr().err


def test_truncated_recording_is_printed_with_exit_code_5(tmp_path, capsys):
    bag = shutil.copytree(BAGS / "wbag", tmp_path / "wbag")
    whole = (bag / "wbag_1.mcap").read_bytes()
    (bag / "wbag_1.mcap").write_bytes(whole[: len(whole) // 2])
    assert main(["bag", "echo", "wbag", "AAA", "--csv"]) == 5
    said = capsys.readouterr()
    assert 100 < len(said.out.splitlines()) < 804
    assert said.err.startswith("warning: wbag/wbag_1.mcap at byte ")
    assert said.err.count("\n") == 1


def test_unreadable_topic_is_reported_with_the_reason(talker, capsys):
    (file,) = talker.glob("*.mcap")
    file.write_bytes(file.read_bytes()[:1500])
    assert main(["bag", "echo", "talker", "topic"]) == 4
    assert "0 messages come before it" in capsys.readouterr().err


def test_unreadable_message_is_reported_and_skipped(tmp_path, capsys):
    from mcap.writer import Writer

    with (tmp_path / "odd.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "a test")
        channel = writer.register_channel(
            "/a", "cdr", writer.register_schema("std_msgs/msg/Bool", "ros2msg", b"bool data")
        )
        for number, data in enumerate([b"\0\1\0\0\1", b"\0\1\0\0\7", b"", b"\0\1\0\0\0"]):
            writer.add_message(channel, number, data, number, number + 1)
        writer.finish()
    assert main(["bag", "echo", str(tmp_path / "odd.mcap"), "a"]) == 0
    said = capsys.readouterr()
    assert said.out == "data: true\n---\ndata: false\n---\n"
    assert "message 2 of /a is left out" in said.err
    assert "a bool is 0 or 1, not 7" in said.err
