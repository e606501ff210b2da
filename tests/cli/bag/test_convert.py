import json
import os
import pty
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from busflow.cli import main
from tests.recording.conftest import write_numbers

BAGS = Path(__file__).parents[2] / "cases/rosbag2"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("form", ["ros2bag", "csv", "parquet", "jsonl", "mcap"])
def test_every_form_is_made_by_the_command(form, shell):
    assert shell(f"bag convert {BAGS}/talker out --to {form}") == 0
    assert shell(f"bag convert {BAGS}/talker out --to {form}") == 2


def test_the_suffix_says_the_format(capsys):
    for name, form in (("a.mcap", "mcap"), ("a.jsonl", "jsonl")):
        assert main(["bag", "convert", str(BAGS / "talker"), name, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["to"] == form
    assert main(["bag", "convert", str(BAGS / "talker"), "tables"]) == 2


def test_words_of_ros_2_are_answered(shell):
    for line in ("-i a.mcap -o b", "a.mcap -o b", "a.mcap b -s mcap"):
        assert shell(f"bag convert {line}") == 2
    for line in ("play -i a.mcap", "info -s mcap a.mcap"):
        assert shell(f"bag {line}") == 2


def test_a_bag_that_is_compressed_or_has_no_metadata(shell):
    zstandard = pytest.importorskip("zstandard")
    Path("a.mcap.zstd").write_bytes(zstandard.compress(b"x"))
    assert shell("bag info a.mcap.zstd") == 2
    shutil.copy(next((BAGS / "cdr_test_sqlite3").glob("*.db3")), "alone.db3")
    assert main(["bag", "verify", "alone.db3"]) == 0


def test_lines_of_json_go_to_standard_output(shell):
    assert shell(f"bag convert {BAGS}/talker - --to jsonl --topics topic --end 1.1s") == 0
    assert not Path("-").exists()
    for form in ("csv", "jsonl --json"):
        assert shell(f"bag convert {BAGS}/talker - --to {form}") == 2


def test_topics_and_a_stretch_of_time(capsys):
    how = ["--to", "jsonl", "--topics", "topic", "--start", "1s", "--end", "2.2s", "--json"]
    assert main(["bag", "convert", str(BAGS / "talker"), "out", *how]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "version": 1,
        "output": "out",
        "to": "jsonl",
        "messages": 3,
        "left_out": 0,
    }
    lines = [json.loads(line) for line in Path("out").read_text().splitlines()]
    assert [each["message"]["data"] for each in lines] == [f"Hello, world! {number}" for number in (2, 3, 4)]
    assert main(["bag", "convert", str(BAGS / "talker"), "b", "--to", "csv", "--topics", "talk"]) == 4


def test_truncated_recording_is_converted_up_to_the_cut(tmp_path, shell):
    path = write_numbers(tmp_path / "numbers.mcap", 500)
    path.write_bytes(path.read_bytes()[:4000])
    assert shell("bag convert numbers.mcap out.jsonl --to jsonl", mask={r"\d+ messages|at byte .*": "#"}) == 5
    assert len(Path("out.jsonl").read_text().splitlines()) > 50


def test_progress_bar_is_shown_in_a_terminal(tmp_path):
    write_numbers(tmp_path / "numbers.mcap", 9000)
    leader, follower = pty.openpty()
    command = [sys.executable, "-m", "busflow", "bag", "convert", "numbers.mcap", "out", "--to", "jsonl"]
    environment = {**os.environ, "TERM": "xterm", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(command, stderr=follower, stdout=subprocess.PIPE, env=environment)
    os.close(follower)
    shown = os.read(leader, 1 << 16).decode()
    os.close(leader)
    assert (done.returncode, done.stdout) == (0, b"out: 9000 messages\n")
    assert "converting" in shown
    assert "8000/9000" in shown
    assert shown.endswith("\x1b[?25h\r\n\x1b[A\x1b[2K")
