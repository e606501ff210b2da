"""Intake: what is acknowledged and when, on a line that only writes down what it is told."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.errors import MalformedMessage
from busflow.wire.line import packets
from busflow.wire.line.intake import NEXT, Intake, IntakeEvent, IntakeState
from busflow.wire.line.packets import Kind, Wanted

ATTACHMENT = bytes(33)


class Line:
    """Writes down what an intake says."""

    def __init__(self) -> None:
        self.told: list[bytes] = []
        self.forgotten: list[int] = []
        self.filled: list[Intake] = []

    def tell(self, packet: bytes) -> None:
        self.told.append(packet)

    def forget(self, number: int) -> None:
        self.forgotten.append(number)

    @property
    def credited(self) -> list[int]:
        return [packets.values_of(data)[1] for data in self.told if data[0] == Kind.CREDIT]


def made(depth: int = 10):
    line, arrived, ended = Line(), list[tuple[object, bytes]](), list[bool]()
    return line, arrived, ended, Intake(7, Wanted(depth), arrived.extend, lambda: ended.append(True), line)


@pytest.mark.hypothesis
@given(st.lists(st.integers(-40, 32), max_size=200))
def test_no_packet_is_acknowledged_before_its_messages(steps):
    """A positive number is a packet with so many messages, zero a part; a negative one acknowledges so many."""
    line, arrived, _, intake = made()
    sizes, open_parts, done = list[int](), 0, 0
    for step in steps:
        if step > 0 and not open_parts:
            intake.add_all([(b"x", ATTACHMENT)] * step)
            sizes.append(step)
        elif step == 0:
            intake.add_part(b"x")
            sizes.append(0)
            open_parts += 1
        elif step < 0:
            intake.hand_over()
            count = min(-step, len(arrived) - done)
            done += count
            intake.acknowledge(count)
        else:
            intake.add(b"x", ATTACHMENT)
            sizes.append(1)
            open_parts = 0
        credited = sum(line.credited)
        assert sum(sizes[:credited]) <= done
        whole = next((at for at in range(len(sizes), -1, -1) if sum(sizes[:at]) <= done), 0)
        assert whole - credited < 16  # half of the window


def test_packets_are_acknowledged_by_the_half_of_the_window():
    line, _, _, intake = made()
    for _ in range(32):
        intake.add(b"x", ATTACHMENT)
    assert line.filled == [intake]
    intake.hand_over()
    intake.acknowledge(15)
    assert line.credited == []
    intake.acknowledge(1)
    assert line.credited == [16]


def test_a_burst_is_acknowledged_with_its_last_message():
    line, _, _, intake = made()
    for _ in range(16):
        intake.add_all([(b"x", ATTACHMENT)] * 4)
    intake.acknowledge(63)
    assert line.credited == []
    intake.acknowledge(1)
    assert line.credited == [16]


def test_a_piece_is_acknowledged_at_once():
    line, _, _, intake = made()
    intake.add(b"x", ATTACHMENT)
    intake.add_all([(b"piece", ATTACHMENT)], is_urgent=True)
    intake.acknowledge(2)
    assert line.credited == [2]


def test_a_smaller_window_gets_back_what_is_due():
    line, _, _, intake = made(1000)
    for _ in range(40):
        intake.add(b"x", ATTACHMENT)
    intake.acknowledge(40)
    assert line.credited == []
    intake.change(Wanted(1))
    assert line.credited == [40]


def test_parts_are_one_message():
    line, arrived, _, intake = made()
    intake.add_part(b"a")
    intake.add_part(b"b")
    intake.hand_over()
    assert arrived == []
    assert line.credited == [1, 1]
    intake.add(b"c", ATTACHMENT)
    intake.hand_over()
    assert arrived == [(b"abc", ATTACHMENT)]


def test_a_message_that_ends_before_its_last_part_is_dropped():
    _, arrived, ended, intake = made()
    intake.add_part(b"a")
    intake.end()
    intake.end()
    assert (arrived, ended) == ([], [True])


def test_other_messages_between_parts_are_a_fault():
    _, _, _, intake = made()
    intake.add_part(b"a")
    with pytest.raises(MalformedMessage):
        intake.add_all([(b"x", ATTACHMENT)])


def test_parts_without_end_are_a_fault():
    _, _, _, intake = made()
    part = bytes(64 << 20)
    for _ in range(4):
        intake.add_part(part)
    with pytest.raises(MalformedMessage):
        intake.add_part(b"x")


def test_a_closed_intake_says_so_once_and_nothing_more():
    line, _, ended, intake = made()
    intake.add_all([(b"piece", ATTACHMENT)], is_urgent=True)
    intake.close()
    intake.close()
    intake.acknowledge(1)
    intake.change(Wanted(3))
    intake.end()
    assert line.told == [packets.head(Kind.CLOSE, 7)]
    assert (line.forgotten, ended) == ([7], [])


def test_the_table_names_every_state_and_ends_in_each():
    assert set(NEXT) == set(IntakeState)
    assert all(nexts[IntakeEvent.END] is IntakeState.ENDED for nexts in NEXT.values())
