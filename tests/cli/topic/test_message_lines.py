"""Messages from a stream: one a line, and where a line is none."""

import io

import pytest

from busflow.cli.terminal.field_paths import shape_of
from busflow.cli.topic.message_lines import MessageLines
from busflow.errors import InvalidInput
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.launchfile.yaml.document import MAX_BYTES
from busflow.msgs.std_msgs import Float64


def lines(text: bytes) -> MessageLines:
    support = TypeSupport(Float64)
    type_ = ForeignType(support.name, support.type_hash, support.description)
    return MessageLines(io.BytesIO(text), type_, shape_of(type_))


def test_each_line_is_a_message():
    text = b'{"data": 1}\n\n{data: 2.5}\r\ndata: 3\n  \n{}'
    assert [values.at(0) for values in lines(text)] == [{"data": 1}, {"data": 2.5}, {"data": 3}, {}]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (
            b"{data: oops}",
            "standard input:3:8: error: std_msgs/msg/Float64: data: 'oops' is not a valid float64\n  {data: oops}\n",
        ),
        (b'{"data": 1', "standard input:3:1: error: "),
        (b"1.5", "standard input:3:1: error: std_msgs/msg/Float64 takes its fields by name"),
        (b"{data: \xff}", "standard input:3:"),
        (b"x" * (MAX_BYTES + 1), f"standard input:3:1: error: the line has more than {MAX_BYTES} bytes\n"),
    ],
    ids=["value", "unfinished", "no field", "no text", "too long"],
)
def test_bad_line_has_its_place_and_a_fix(line: bytes, expected: str):
    stream = iter(lines(b"{data: 1}\n\n" + line + b"\n{data: 2}"))
    assert next(stream).at(0) == {"data": 1}
    with pytest.raises(InvalidInput) as raised:
        next(stream)
    assert str(raised.value).startswith(expected)
    assert "  fix: " in str(raised.value)
