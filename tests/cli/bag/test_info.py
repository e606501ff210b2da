from pathlib import Path

import pytest
from mcap.writer import IndexType, Writer

from busflow.cli import main

BAGS = Path(__file__).parents[2] / "cases/rosbag2"


def test_bag_content_is_shown(shell):
    assert shell(f"bag info {BAGS}/talker") == 0
    answer = shell.data(f"bag info {BAGS}/talker --digest")
    assert (answer["version"], answer["messages"], answer["complete"], len(answer["digest"])) == (1, 20, True, 64)
    assert [(each["name"], each["messages"]) for each in answer["topics"]][-1] == ("/topic", 10)


@pytest.mark.parametrize(
    ("index_types", "rates"), [(IndexType.ALL, [10.0, 10.0]), (IndexType.ALL & ~IndexType.MESSAGE, [10.0, 2.0])]
)
def test_indexed_rate_spans_first_to_last_message(tmp_path, shell, index_types, rates):
    with (tmp_path / "late.mcap").open("wb") as stream:
        writer = Writer(stream, chunk_size=500, index_types=index_types)
        writer.start("ros2", "a test")
        schema = writer.register_schema("std_msgs/msg/Bool", "ros2msg", b"bool data\n")
        early, late = (writer.register_channel(topic, "cdr", schema) for topic in ("/early", "/late"))
        for number in range(501):
            writer.add_message(early, number * 100_000_000, b"\0\1\0\0\1", number * 100_000_000)
            if 200 <= number <= 300:
                writer.add_message(late, number * 100_000_000, b"\0\1\0\0\1", number * 100_000_000)
        writer.finish()
    assert [each["rate_hz"] for each in shell.data(f"bag info {tmp_path}/late.mcap")["topics"]] == rates


@pytest.mark.parametrize(
    "content",
    [b"", b"\x89MCAP0\r\n", b"hello", b"SQLite format 3\0", b"#ROSBAG V2.0"],
    ids=["empty", "begun", "text", "sqlite", "ros 1"],
)
def test_non_recording_is_reported_in_one_line(tmp_path, shell, content):
    (tmp_path / "odd.mcap").write_bytes(content)
    assert shell(f"bag info {tmp_path}/odd.mcap") == 2


def test_other_files_are_errors(tmp_path, shell):
    for path in (tmp_path, tmp_path / "none.mcap", "/dev/zero"):
        assert shell(f"bag info {path}") == 2


def test_names_in_a_file_cannot_steer_the_terminal(tmp_path, capsys):
    with (tmp_path / "odd.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "lib\x1b[31m")
        schema = writer.register_schema("a/msg/\x1b[2J", "ros2msg", b"bool data")
        channel = writer.register_channel("/a\x1b]0;owned\x07\u202e\n", "cdr", schema)
        writer.add_message(channel, (1 << 64) - 1, b"", 0)
        writer.finish()
    for more in ([], ["--json"]):
        assert main(["bag", "info", str(tmp_path / "odd.mcap"), *more]) == 0
        assert not set(capsys.readouterr().out) & set("\x1b\x07\u202e")
    assert main(["bag", "echo", str(tmp_path / "odd.mcap"), "b"]) == 4
    assert not set(capsys.readouterr().err) & set("\x1b\x07\u202e")
