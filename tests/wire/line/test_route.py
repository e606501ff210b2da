"""Route: order, window, and account of a route, on a carrier that the test makes full or empty."""

from collections import Counter
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from busflow.bus.qos import Overflow
from busflow.errors import MalformedMessage
from busflow.wire.line import packets
from busflow.wire.line.arena import Arena, Stored
from busflow.wire.line.packets import PAYLOAD_AT, SMALL, Kind, Reason, Wanted
from busflow.wire.line.route import CLOSE_NS, NEXT, Route, RouteEvent, RouteState
from busflow.wire.zenoh.keys import Attachment, attachment_bytes
from busflow.wire.zenoh.sender import LARGE

GIDS = (b"a" * 16, b"b" * 16)
WINDOW = 32


class Carrier:
    """A socket that holds as many packets as the test says."""

    def __init__(self, room: int = 10**9) -> None:
        self.room = room
        self.sent: list[bytes] = []
        self.places: list[Stored] = []
        self.turn: list[Callable[[], None]] = []
        self.blocked: list[Route] = []

    def transmit(self, packet: bytes) -> None:
        if not self.room:
            raise BlockingIOError
        self.room -= 1
        self.sent.append(packet)

    def transmit_piece(self, packet: bytes, stored: Stored) -> None:
        self.transmit(packet)
        self.places.append(stored)

    def wait_for_room(self, route: Route) -> None:
        self.blocked.append(route)

    def call_soon(self, function: Callable[[], None]) -> None:
        self.turn.append(function)

    def end_turn(self) -> None:
        turn, self.turn = self.turn, []
        for function in turn:
            function()

    def have_room(self, room: int) -> None:
        self.room = room
        blocked, self.blocked = self.blocked, []
        for route in blocked:
            route.flush()

    @property
    def messages(self) -> list[tuple[bytes | Reason, Attachment]]:
        """What a reader finds in the packets."""
        found, parts = list[tuple[bytes | Reason, Attachment]](), b""
        for data in self.sent:
            match data[0]:
                case Kind.PART:
                    parts += data[packets.HEAD_BYTES :]
                case Kind.MESSAGE:
                    signed = Attachment.decode(data[packets.HEAD_BYTES : PAYLOAD_AT])
                    found.append((parts + data[PAYLOAD_AT:], signed))
                    parts = b""
                case Kind.BURST:
                    found += [(payload, Attachment.decode(each)) for payload, each in packets.read_burst(data)]
                case Kind.PIECE:
                    _, attachment, _, size = packets.values_of(data)
                    found.append((bytes(size), Attachment.decode(attachment)))
                case Kind.MARK:
                    _, attachment, reason = packets.values_of(data)
                    found.append((Reason(reason), Attachment.decode(attachment)))
        return found


class Publishers:
    """Two publishers of one topic, whose messages are numbered."""

    def __init__(self, route: Route) -> None:
        self.route, self.now_ns = route, 0
        self.published = Counter[bytes]()

    def publish(self, payload: bytes | Stored = b"x", *, gid: bytes = GIDS[0], after_ns: int = CLOSE_NS + 1) -> None:
        self.published[gid] += 1
        self.now_ns += after_ns
        self.route.send(payload, attachment_bytes(self.published[gid], self.now_ns, gid), self.now_ns)


def made(depth: int = 10, overflow: Overflow = Overflow.DROP_OLDEST, room: int = 10**9):
    carrier = Carrier(room)
    route = Route(7, "key", "session", Wanted(depth, overflow), carrier)
    return carrier, route, Publishers(route)


def numbers(carrier: Carrier) -> list[int]:
    return [each.sequence for _, each in carrier.messages]


sends = st.tuples(
    st.just("send"),
    st.sampled_from([1, SMALL, SMALL + 1, 3 * LARGE]),
    st.sampled_from([1, CLOSE_NS + 1]),
    st.sampled_from(GIDS),
    st.booleans(),
)
steps = st.lists(
    st.one_of(
        sends,
        sends,
        st.tuples(st.just("acknowledge"), st.integers(0, 40)),
        st.tuples(st.just("room"), st.integers(0, 5)),
        st.just(("turn",)),
        st.tuples(st.just("change"), st.integers(1, 5)),
    ),
    min_size=30,
    max_size=150,
)


@pytest.mark.hypothesis
@settings(max_examples=100)
@given(steps, st.integers(1, 5), st.sampled_from([Overflow.DROP_OLDEST, Overflow.DROP_NEWEST]))
def test_order_window_and_account_hold_whatever_happens(steps, depth, overflow):
    carrier, route, publishers = made(depth, overflow)
    arena = Arena(16 << 20)
    for step in steps:
        match step:
            case ("send", size, after_ns, gid, in_memory):
                payload = arena.store(bytes(size)) if in_memory and size > LARGE else bytes(size)
                publishers.publish(payload, gid=gid, after_ns=after_ns)
                if isinstance(payload, Stored):
                    payload.release()
            case ("acknowledge", count):
                route.acknowledge(min(count, route.unacknowledged))
            case ("room", room):
                carrier.have_room(room)
            case ("turn",):
                carrier.end_turn()
            case ("change", depth):
                route.change(Wanted(depth, overflow))
        assert route.unacknowledged <= WINDOW + len(GIDS)  # marks may go beyond
        if route.state is RouteState.WAITING:
            assert route.waiting <= depth + 1  # one may have left in part
        taken_by = [stored for stored in carrier.places if stored.is_held]
        assert len(taken_by) <= max(depth, 2) or any(step[0] == "change" for step in steps)
    carrier.have_room(10**9)
    carrier.end_turn()
    while route.unacknowledged or route.waiting:
        route.acknowledge(route.unacknowledged)
    assert_accounted(carrier, route, publishers)
    assert arena.taken == 0
    assert route.state is RouteState.READY


def assert_accounted(carrier: Carrier, route: Route, publishers: Publishers) -> None:
    """Each publisher's messages came in order; the gaps and marks are what was dropped."""
    dropped = 0
    for gid, published in publishers.published.items():
        last = 0
        for payload, signed in carrier.messages:
            if signed.gid != gid:
                continue
            assert signed.sequence > last
            dropped += signed.sequence - last - (payload is not Reason.OVERFLOW)
            last = signed.sequence
        assert last == published
    assert dropped == route.dropped
    assert route.sent + route.dropped == publishers.published.total()


def test_the_table_names_every_state_and_ends_in_each():
    assert set(NEXT) == set(RouteState)
    assert all(nexts[RouteEvent.ENDED] is RouteState.ENDED for nexts in NEXT.values())


def test_a_message_that_comes_alone_leaves_at_once():
    carrier, route, publishers = made()
    publishers.publish(b"a")
    assert carrier.messages[0][0] == b"a"
    assert route.state is RouteState.READY


def test_messages_that_follow_closely_leave_with_the_end_of_the_turn():
    carrier, route, publishers = made()
    for _ in range(3):
        publishers.publish(after_ns=1)
    assert route.state is RouteState.GATHERING
    assert numbers(carrier) == []
    carrier.end_turn()
    assert numbers(carrier) == [1, 2, 3]
    assert len(carrier.sent) == 1


def test_a_large_message_does_not_wait_for_the_end_of_the_turn():
    carrier, _, publishers = made()
    publishers.publish(after_ns=1)
    publishers.publish(bytes(SMALL + 1), after_ns=1)
    assert numbers(carrier) == [1, 2]


@pytest.mark.parametrize(
    ("overflow", "expected"), [(Overflow.DROP_OLDEST, [99, 100]), (Overflow.DROP_NEWEST, [33, 34, 100])]
)
def test_behind_the_window_waits_as_much_as_the_queue_keeps(overflow, expected):
    carrier, route, publishers = made(2, overflow)
    for _ in range(100):
        publishers.publish()
    assert numbers(carrier) == [*range(1, 33)]
    assert (route.waiting, route.dropped) == (2, 66)
    route.acknowledge(32)
    assert numbers(carrier)[32:] == expected


def test_of_gathered_messages_that_are_dropped_the_last_is_marked():
    carrier, route, publishers = made(1, Overflow.DROP_NEWEST)
    for _ in range(32):
        publishers.publish()
    route.acknowledge(31)
    carrier.room = 0
    for _ in range(5):
        publishers.publish(after_ns=1)
    carrier.end_turn()
    carrier.have_room(100)
    assert numbers(carrier)[32:] == [33, 37]
    assert carrier.messages[-1][0] is Reason.OVERFLOW


def test_a_deeper_queue_gets_more_at_once():
    carrier, route, publishers = made(2)
    for _ in range(40):
        publishers.publish()
    route.change(Wanted(100))
    assert numbers(carrier) == [*range(1, 33), 39, 40]


def test_a_reader_holds_no_more_pieces_than_its_queue():
    carrier, route, publishers = made(3)
    arena = Arena(1 << 20)
    for _ in range(10):
        publishers.publish(arena.store(bytes(4096)))
    assert len(carrier.places) == 3
    route.acknowledge(1)
    assert len(carrier.places) == 4


def test_a_message_that_has_left_in_part_is_not_dropped():
    carrier, route, publishers = made(1, room=2)
    publishers.publish(bytes(4 * LARGE))
    for _ in range(5):
        publishers.publish(b"x")
    carrier.have_room(100)
    assert [(len(payload), each.sequence) for payload, each in carrier.messages] == [(4 * LARGE, 1), (1, 6)]
    assert route.dropped == 4


def test_bytes_that_wait_are_limited_too():
    carrier, route, publishers = made(1000, room=0)
    large = bytes(40 << 20)
    for _ in range(3):
        publishers.publish(large)
    assert (route.waiting, route.dropped) == (1, 2)
    carrier.have_room(10**9)


def test_the_end_of_the_sender_is_marked():
    carrier, route, publishers = made(2)
    for _ in range(40):
        publishers.publish()
    route.give_up()
    assert carrier.messages[-1] == (Reason.END, Attachment(40, publishers.now_ns, GIDS[0]))


def test_an_ended_route_holds_and_sends_nothing():
    carrier, route, publishers = made(3)
    arena = Arena(1 << 20)
    for _ in range(10):
        stored = arena.store(bytes(4096))
        publishers.publish(stored)
        stored.release()
    assert route.end()
    assert arena.taken == 0
    count = len(carrier.sent)
    publishers.publish()
    carrier.end_turn()
    assert len(carrier.sent) == count


def test_a_route_ends_without_open_pieces_once_they_are_acknowledged():
    _, route, publishers = made(3)
    arena = Arena(1 << 20)
    publishers.publish(arena.store(bytes(4096)))
    route.acknowledge(1)
    assert not route.end()


def test_an_acknowledgement_of_what_was_not_sent_is_refused():
    _, route, publishers = made()
    publishers.publish()
    with pytest.raises(MalformedMessage):
        route.acknowledge(2)
