"""The last lines of a log: how many are kept, and which are asked for."""

from busflow.log import LogRecord
from busflow.wire.queries.logs import DEPTH, LogBook


def record(number, *, level="info", node="/arm", **values):
    return LogRecord(number, level, node, f"line {number}", values)


def test_a_log_keeps_last_lines_and_counts_all():
    book = LogBook()
    for number in range(DEPTH + 5):
        book.write(record(number))
    kept = book.last(DEPTH * 2)
    assert (len(kept), kept[0].text, kept[-1].text, book.written) == (DEPTH, "line 5", f"line {DEPTH + 4}", DEPTH + 5)
    assert [line.stamp_ns for line in book.last(2)] == [DEPTH + 3, DEPTH + 4]
    assert book.last(0) == []


def test_log_lines_are_filtered_by_node_and_level():
    book = LogBook()
    for number, level in enumerate(("debug", "warning", "error", "critical")):
        book.write(record(number, level=level, node=f"/n{number % 2}"))
    assert [line.level for line in book.last(9, level=30)] == [30, 40, 50]
    assert [line.level for line in book.last(9, node="/n0")] == [10, 40]
    assert [line.level for line in book.last(1, node="/n0", level=20)] == [40]


def test_values_are_text_as_they_were_then():
    book, joints = LogBook(), [1]
    book.write(record(1, joints=joints))
    joints.append(2)
    assert book.last(1)[0].text == "line 1 joints=[1]"
