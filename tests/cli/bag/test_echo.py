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


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("topic", 0),
        ("/rosout --csv --field msg -n 2", 0),
        ("topic --raw --once", 0),
        ("topic --no-str --once", 0),
        ("topic --filter \"data == 'Hello, world! 7'\"", 0),
        ("topic --start 1s --end 2.2s", 0),
        ("topic --start 0s --last 1", 0),
        ("topic --start 100s", 2),
        (f"topic --last {10**20}", 2),
        ("topicc", 4),
        ("topic --field dat", 2),
    ],
)
def test_output(shell, line, code):
    assert shell(f"bag echo talker {line}") == code


def test_json_is_that_of_topic_echo(shell):
    answer = shell.data("bag echo talker topic --once")
    assert answer.pop("published_ns") // 10**9 == 1585866235
    assert answer == {"version": 1, "topic": "/topic", "sequence": None, "message": {"data": "Hello, world! 0"}}


def test_truncated_recording_is_printed_with_exit_code_5(tmp_path, capsys):
    bag = shutil.copytree(BAGS / "wbag", tmp_path / "wbag")
    whole = (bag / "wbag_1.mcap").read_bytes()
    (bag / "wbag_1.mcap").write_bytes(whole[: len(whole) // 2])
    assert main(["bag", "echo", "wbag", "AAA", "--csv"]) == 5
    said = capsys.readouterr()
    assert 100 < len(said.out.splitlines()) < 804
    assert said.err.startswith("warning: wbag/wbag_1.mcap at byte ")
    assert said.err.count("\n") == 1


def test_unreadable_topic_is_reported_with_the_reason(talker, shell):
    (file,) = talker.glob("*.mcap")
    file.write_bytes(file.read_bytes()[:1500])
    assert shell("bag echo talker topic", mask={r"byte .*cut off": "byte …: the file was cut off"}) == 4


def test_unreadable_message_is_reported_and_skipped(tmp_path, shell):
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
    assert shell(f"bag echo {tmp_path}/odd.mcap a") == 0
