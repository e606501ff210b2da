from pathlib import Path

import pytest
from mcap.writer import Writer

from busflow.cli import main
from busflow.recording.mcap.chunks import Chunk
from busflow.recording.mcap.contents import Contents
from tests.recording.conftest import write_numbers

LAB = Path(__file__).parents[3] / "configs/lab1.yaml"


@pytest.fixture
def numbers(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return write_numbers(tmp_path / "numbers.mcap", 500)


BYTES = {
    r"byte \d+|\d+ (of \d+ )?messages|and \d+ are": "#",
    r"(index of channel|bytes of a|INCOMPLETE:) .*": r"\1 …",
    r"\d+ of the \d+ bytes": "bytes",
}
"""Where the file is cut or wrong, which the version of a library decides."""


def test_intact_recording_is_right(numbers, shell):
    assert shell(f"bag verify {numbers.name}") == 0


def test_truncated_recording_is_incomplete(numbers, shell):
    content = numbers.read_bytes()
    numbers.write_bytes(content[: len(content) // 2])
    assert shell(f"bag verify {numbers.name}", mask=BYTES) == 5


def test_error_is_shown_with_its_position(numbers, shell):
    content = bytearray(numbers.read_bytes())
    content[len(content) // 2] ^= 4
    numbers.write_bytes(content)
    assert shell(f"bag verify {numbers.name}", mask=BYTES) == 3
    answer = shell.data(f"bag verify {numbers.name}", code=3)
    assert (answer["version"], answer["ok"]) == (1, False)
    assert {each["kind"] for each in answer["findings"]} == {"wrong"}


def test_messages_behind_damage_are_counted_not_read(numbers, shell):
    with Contents(numbers) as contents:
        second = [found.offset for found in contents.beyond_damage() if isinstance(found.record, Chunk)][1]
    content = bytearray(numbers.read_bytes())
    content[second + 100] ^= 0xFF
    numbers.write_bytes(content)
    assert shell(f"bag verify {numbers.name}", mask=BYTES) == 3
    answer = shell.data(f"bag verify {numbers.name}", code=3)
    assert 0 < answer["messages"] < answer["there"] < 500


def test_non_recording_is_an_error(tmp_path, shell):
    (tmp_path / "a.mcap").write_text("hello")
    assert shell(f"bag verify {tmp_path}/a.mcap") == 2
    assert shell(f"bag recover {tmp_path}/a.mcap") == 2


def test_a_bit_flipped_outside_the_chunks_is_seen(tmp_path, monkeypatch, shell):
    monkeypatch.chdir(tmp_path)
    assert main(["run", str(LAB), "--sim", "--for", "1s", "--record", "run.mcap"]) == 0
    content = bytearray(Path("run.mcap").read_bytes())
    content[content.rindex(b"exit_code") + 1] ^= 1  # in the ledger, which no other CRC is about but that of the summary
    Path("run.mcap").write_bytes(content)
    assert shell("bag verify run.mcap", mask=BYTES) == 3


HOSTILE = {
    "size": ("ros2msg", f"uint8[{'9' * 5000}] x\n", "cdr", b"\0\1\0\0"),
    "depth": (
        "ros2msg",
        "a/T0 x\n" + "".join(f"{'=' * 80}\nMSG: a/T{n}\nT{n + 1} x\n" for n in range(2000)),
        "cdr",
        b"",
    ),
    "schema": ("jsonschema", '{"items":' * 20_000 + "1" + "}" * 20_000, "json", b"{}"),
    "digits": ("jsonschema", "{}", "json", b'{"x": ' + b"9" * 5000 + b"}"),
    "nesting": ("jsonschema", "{}", "json", b'{"x": ' + b"[" * 600 + b"]" * 600 + b"}"),
    "text": ("jsonschema", "{}", "json", b'{"x": "\\ud800"}'),
}


@pytest.fixture
def hostile(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with (tmp_path / "hostile.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start("", "a test")
        writer.add_metadata("busflow.ledger", {"recorded": "--1", "report": '{"topics": ' + "9" * 5000 + "}"})
        good = writer.register_schema("std_msgs/msg/Bool", "ros2msg", b"bool data\n")
        writer.add_message(writer.register_channel("/good", "cdr", good), 1, b"\0\1\0\0\1", 1, 1)
        for topic, (form, definition, encoding, payload) in HOSTILE.items():
            schema = writer.register_schema("a/msg/B", form, definition.encode())
            writer.add_message(writer.register_channel(f"/{topic}", encoding, schema), 1, payload, 1, 1)
        writer.finish()
    return "hostile.mcap"


@pytest.mark.parametrize(
    "command",
    [["verify"], ["verify", "--json"], ["convert", "out", "--to", "csv"], ["convert", "out", "--to", "jsonl"]],
    ids=" ".join,
)
def test_hostile_channels_are_named_in_one_file(hostile, command, capsys):
    main(["bag", command[0], hostile, *command[1:]])
    said = "".join(capsys.readouterr())
    assert "bug in busflow" not in said
    assert [topic for topic in HOSTILE if f"/{topic}" not in said] == []


@pytest.mark.parametrize("topic", ["good", *HOSTILE])
def test_hostile_channel_costs_only_itself(hostile, topic, capsys):
    code = main(["bag", "echo", hostile, f"/{topic}"])
    said = capsys.readouterr()
    assert "bug in busflow" not in said.err
    assert (topic == "good") == (code == 0 and "data: true" in said.out)
    assert main(["bag", "info", hostile]) in (0, 5)
