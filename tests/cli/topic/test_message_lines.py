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
from tests.golden import Golden


def lines(text: bytes) -> MessageLines:
    support = TypeSupport(Float64)
    type_ = ForeignType(support.name, support.type_hash, support.description)
    return MessageLines(io.BytesIO(text), type_, shape_of(type_))


def test_each_line_is_a_message():
    text = b'{"data": 1}\n\n{data: 2.5}\r\ndata: 3\n  \n{}'
    assert [values.at(0) for values in lines(text)] == [{"data": 1}, {"data": 2.5}, {"data": 3}, {}]


@pytest.mark.parametrize(
    "line",
    [b"{data: oops}", b'{"data": 1', b"1.5", b"{data: \xff}", b"x" * (MAX_BYTES + 1)],
    ids=["value", "unfinished", "no field", "no text", "too long"],
)
def test_bad_line_has_its_place_and_a_fix(line: bytes, golden: Golden):
    stream = iter(lines(b"{data: 1}\n\n" + line + b"\n{data: 2}"))
    assert next(stream).at(0) == {"data": 1}
    with golden.raises(InvalidInput) as raised:
        next(stream)
    assert isinstance(raised.value, InvalidInput)
    place = raised.value.problem.place
    assert place is not None
    assert (place.file, place.line) == ("standard input", 3)
