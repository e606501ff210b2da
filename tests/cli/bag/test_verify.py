import json
import re
from pathlib import Path

import pytest

from busflow.cli import main
from busflow.recording.mcap.chunks import Chunk
from busflow.recording.mcap.contents import Contents
from tests.recording.conftest import write_numbers

LAB = Path(__file__).parents[3] / "configs/lab1.yaml"


@pytest.fixture
def numbers(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return write_numbers(tmp_path / "numbers.mcap", 500)


def test_intact_recording_is_right(numbers, capsys):
    assert main(["bag", "verify", numbers.name]) == 0
    assert capsys.readouterr().out == "numbers.mcap: all is right: 500 messages were read\n"


def test_truncated_recording_is_incomplete(numbers, capsys):
    content = numbers.read_bytes()
    numbers.write_bytes(content[: len(content) // 2])
    assert main(["bag", "verify", numbers.name]) == 5
    assert "numbers.mcap: INCOMPLETE: " in capsys.readouterr().out


def test_error_is_shown_with_its_position(numbers, capsys):
    content = bytearray(numbers.read_bytes())
    content[len(content) // 2] ^= 4
    numbers.write_bytes(content)
    assert main(["bag", "verify", numbers.name]) == 3
    said = capsys.readouterr().out
    assert said.startswith("error: numbers.mcap at byte ")
    assert "NOT RIGHT" in said
    assert main(["bag", "verify", numbers.name, "--json"]) == 3
    answer = json.loads(capsys.readouterr().out)
    assert (answer["version"], answer["ok"]) == (1, False)
    assert {each["kind"] for each in answer["findings"]} == {"wrong"}


def test_messages_behind_damage_are_counted_not_read(numbers, capsys):
    with Contents(numbers) as contents:
        second = [found.offset for found in contents.beyond_damage() if isinstance(found.record, Chunk)][1]
    content = bytearray(numbers.read_bytes())
    content[second + 100] ^= 0xFF
    numbers.write_bytes(content)
    assert main(["bag", "verify", numbers.name]) == 3
    said = capsys.readouterr().out.splitlines()[-1]
    assert re.fullmatch(r"numbers.mcap: NOT RIGHT: \d+ of \d+ messages, those before the damage, were read", said)
    assert main(["bag", "verify", numbers.name, "--json"]) == 3
    answer = json.loads(capsys.readouterr().out)
    assert 0 < answer["messages"] < answer["there"] < 500


def test_non_recording_is_an_error(tmp_path, capsys):
    (tmp_path / "a.mcap").write_text("hello")
    assert main(["bag", "verify", str(tmp_path / "a.mcap")]) == 2
    assert main(["bag", "recover", str(tmp_path / "a.mcap")]) == 2
    assert capsys.readouterr().err.count("it is no MCAP") == 2


def test_a_bit_flipped_outside_the_chunks_is_seen(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", str(LAB), "--sim", "--for", "1s", "--record", "run.mcap"]) == 0
    content = bytearray(Path("run.mcap").read_bytes())
    content[content.rindex(b"exit_code") + 1] ^= 1  # in the ledger, which no other CRC is about but that of the summary
    Path("run.mcap").write_bytes(content)
    capsys.readouterr()
    assert main(["bag", "verify", "run.mcap"]) == 3
    assert "what lies before it is not what its CRC stands for" in capsys.readouterr().out
