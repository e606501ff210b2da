"""A recording's time, and what is played in it: every case of ROS 2's own player that applies."""

import asyncio
import threading

import pytest

import busflow
from busflow.clock import SimClock
from busflow.msgs.std_msgs import Int64
from busflow.recording.bag.bag import Bag
from busflow.recording.player import player as player_module
from busflow.recording.player.ordered_messages import OrderedMessages, Span, chosen
from busflow.recording.player.playback_clock import PlaybackClock
from busflow.recording.player.player import Player
from busflow.recording.player.playing import Playing
from busflow.testing import harness, virtual_time

MS = 1_000_000
S = 1_000_000_000


class Wall:
    """What a playback's time is measured by, set by hand."""

    def __init__(self, ns=0):
        self.ns = ns

    def monotonic_ns(self):
        return self.ns

    def call_at(self, _deadline_ns, _callback):
        raise AssertionError("nobody waits here")


@pytest.fixture
def wall():
    return Wall()


@pytest.fixture
def play(record):
    """Plays numbers of some moments on virtual time: the player, and what it has handed over, with its time."""

    def make(times_ms, *, span=None, topics=None, paused=False, rate=1.0):
        numbers = [("/a", Int64(data=n), ms * MS) for n, ms in enumerate(times_ms, start=1)]
        return make_of(numbers, span=span, topics=topics, paused=paused, rate=rate)

    def make_of(messages, *, span=None, topics=None, paused=False, rate=1.0):
        bag = Bag(record(messages))
        clock, got = SimClock(), []

        async def publish(entry):
            value = entry.channel.decode(entry.payload, Int64).data
            got.append((entry.channel.topic, value, clock.monotonic_ns()))

        tape = OrderedMessages(bag, chosen(bag.channels, topics or ()), span, threaded=False)
        return Playing(tape, clock, publish, rate=rate, paused=paused), got

    make.of = make_of
    return make


def values(got):
    return [value for _, value, _ in got]


def ms(got):
    return [at_ns / MS for _, _, at_ns in got]


# The clock.


def test_the_clock_advances_with_the_wall_clock(wall):
    """clock/start-nonzero"""
    clock = PlaybackClock(wall, 1234567890)
    wall.ns += 5 * S
    assert clock.now_ns() == 1234567890 + 5 * S


def test_it_is_exact_where_doubles_are_not(wall):
    """clock/precision"""
    wall.ns = 0
    clock = PlaybackClock(wall, 0)
    wall.ns = 2**63 - 1
    assert clock.now_ns() == 2**63 - 1
    faster = PlaybackClock(Wall(0), 0, rate=1.5)
    faster._source.ns = 2**62
    assert faster.now_ns() == 2**62 * 3 // 2


@pytest.mark.parametrize("rate", [-5, 0, float("inf"), float("nan")])
def test_a_rate_of_zero_or_below_is_refused(wall, rate):
    """clock/rate--5 clock/rate-0"""
    clock = PlaybackClock(wall, rate=2)
    assert not clock.set_rate(rate)
    assert clock.rate == 2
    with pytest.raises(ValueError, match="above 0"):
        PlaybackClock(wall, rate=rate)


def test_paused_it_stands(wall):
    """clock/pause"""
    clock = PlaybackClock(wall)
    clock.pause()
    wall.ns += S
    assert (clock.now_ns(), clock.is_paused) == (0, True)


@virtual_time
async def test_paused_clock_does_not_sleep():
    """clock/paused-sleep"""
    clock = PlaybackClock(SimClock(), paused=True)
    assert not await clock.sleep_until(10 * S)
    assert asyncio.get_running_loop().time() == 0


@virtual_time
async def test_a_pause_wakes_the_sleeper():
    """clock/pause-interrupts-sleep"""
    clock = PlaybackClock(SimClock())
    asyncio.get_running_loop().call_later(3, clock.pause)
    assert not await clock.sleep_until(10 * S)
    assert asyncio.get_running_loop().time() == 3


@virtual_time
async def test_a_sleep_is_scaled_by_the_rate():
    clock = PlaybackClock(SimClock(), rate=4)
    assert await clock.sleep_until(10 * S)
    assert asyncio.get_running_loop().time() == 2.5


def test_the_rate_counts_from_when_it_is_set(wall):
    """clock/change-rate"""
    clock = PlaybackClock(wall)
    wall.ns += S
    assert clock.now_ns() == S
    clock.set_rate(2)
    wall.ns += S
    assert clock.now_ns() == 3 * S
    clock.pause()
    clock.set_rate(0.5)
    wall.ns += S
    assert clock.now_ns() == 3 * S
    clock.resume()
    wall.ns += 2 * S
    assert clock.now_ns() == 4 * S


def test_a_jump_is_not_scaled(wall):
    """clock/jump-with-rate-forward"""
    clock = PlaybackClock(wall, S, rate=1.5)
    clock.jump(4 * S)
    wall.ns += 2 * S
    assert clock.now_ns() == 7 * S
    clock.jump(S)
    assert clock.now_ns() == S


# Playing.


@pytest.mark.parametrize("rate", [1, 2, 0.5])
def test_it_takes_as_long_as_the_rate_says(play, rate):
    """play/rate-1,2,0.5"""

    @virtual_time
    async def main():
        playing, got = play([0, 100, 400], rate=rate)
        assert await playing.play()
        return ms(got)

    assert main() == [0, 100 / rate, 400 / rate]


@pytest.mark.parametrize(
    ("span", "expected"),
    [
        pytest.param(Span(until_ns=-1), [], id="play/until-before-first"),
        pytest.param(Span(until_ns=50 * MS), [1, 2], id="play/until-equal-last"),
        pytest.param(Span(until_ns=50 * MS - 1), [1], id="play/until-less-than-total"),
        pytest.param(Span(duration_ns=0), [], id="play/duration-0"),
        pytest.param(Span(duration_ns=39 * MS), [1], id="play/duration-39ms"),
        pytest.param(Span(start_ns=-5 * S), [1, 2], id="play/start-offset-negative"),
        pytest.param(Span(start_ns=1), [2], id="a start"),
        pytest.param(Span(start_ns=51 * MS), [], id="a start beyond the end"),
        pytest.param(Span(start_ns=40 * MS, duration_ns=10 * MS), [2], id="counts from the start"),
    ],
)
def test_a_part_is_played(play, span, expected):
    @virtual_time
    async def main():
        playing, got = play([50, 100], span=span)
        assert await playing.play()
        first = values(got)
        playing.clock.pause()
        got.clear()
        assert await playing.play_next() == bool(expected)  # a second round begins with the first
        return first, values(got)

    assert main() == (expected, expected[:1])


def test_the_later_end_counts(play):
    """play/until-and-duration-1"""

    @virtual_time
    async def main():
        messages = [(topic, Int64(data=n), at * MS) for n, topic, at in [
            (1, "/a", 100), (1, "/b", 120), (2, "/a", 200), (2, "/b", 220), (3, "/a", 300), (3, "/b", 320),
        ]]  # fmt: skip
        playing, got = play.of(messages, span=Span(until_ns=50 * MS, duration_ns=20 * MS))
        assert await playing.play()
        return [(topic, value) for topic, value, _ in got]

    assert main() == [("/a", 1), ("/b", 1)]


def test_stopped_it_says_so(play):
    """play/until-interrupted"""

    @virtual_time
    async def main():
        playing, got = play([0, 50, 100], span=Span(until_ns=75 * MS))
        asyncio.get_running_loop().call_later(0.02, playing.stop)
        assert not await playing.play()
        return values(got)

    assert main() == [1]


@pytest.fixture
def stepping(play):
    """Runs a test with a paused player of messages 1 to 5, 10 ms apart."""

    def run(test):
        @virtual_time
        async def main():
            playing, got = play([10, 20, 30, 40, 50], paused=True)
            await test(playing)
            return values(got)

        return main()

    return run


def test_a_seek_before_the_start_is_clamped(stepping):
    """play/seek-back-before-start"""

    async def test(playing):
        assert await playing.play_next()
        assert await playing.play_next()
        playing.seek(10 * MS - 1)
        assert await playing.play_next()
        assert await playing.play_next()

    assert stepping(test) == [1, 2, 1, 2]


def test_a_seek_is_inclusive(stepping):
    """play/seek-to-start"""

    async def test(playing):
        await playing.play_next()
        playing.seek(10 * MS)
        await playing.play_next()

    assert stepping(test) == [1, 1]


def test_seek_forward_skips_messages(stepping):
    """play/seek-forward"""

    async def test(playing):
        await playing.play_next()
        playing.seek(30 * MS)
        while await playing.play_next():
            pass

    assert stepping(test) == [1, 3, 4, 5]


def test_a_seek_past_the_end_keeps_playing(stepping):
    """play/seek-past-end"""

    async def test(playing):
        playing.seek(50 * MS + 1)
        assert not await playing.play_next()
        task = asyncio.create_task(playing.play())
        await asyncio.sleep(1)
        assert not task.done()  # paused at the end, it waits for what comes
        playing.seek(40 * MS)
        assert await playing.play_next()
        playing.stop()
        assert not await task

    assert stepping(test) == [4]


def test_a_seek_back_from_the_end(stepping):
    """play/seek-back-from-end"""

    async def test(playing):
        playing.clock.resume()
        assert await playing.play()
        playing.seek(30 * MS)
        assert await playing.play()

    assert stepping(test) == [1, 2, 3, 4, 5, 3, 4, 5]


def test_it_plays_twice(play):
    """play/twice play/loop"""

    @virtual_time
    async def main():
        playing, got = play([0, 100])
        assert await playing.play()
        assert await playing.play()
        return values(got), ms(got)

    assert main() == ([1, 2, 1, 2], [0, 100, 100, 200])


def test_a_burst_does_not_wait(stepping):
    """play/burst_bursts_requested_messages_without_delays play/burst_stops_at_end_of_file"""

    async def test(playing):
        assert await playing.burst(2) == 2
        assert await playing.burst(9) == 3
        assert asyncio.get_running_loop().time() == 0

    assert stepping(test) == [1, 2, 3, 4, 5]


def test_after_a_burst_it_goes_on_in_time(play):
    """play/play_respect_messages_timing_after_burst play/player_can_resume_after_burst"""

    @virtual_time
    async def main():
        playing, got = play([10, 20, 30, 40, 50], paused=True)
        task = asyncio.create_task(playing.play())
        await asyncio.sleep(1)
        assert await playing.burst(2) == 2
        playing.clock.resume()
        assert await task
        return values(got), ms(got)

    assert main() == ([1, 2, 3, 4, 5], [1000, 1000, 1010, 1020, 1030])


def test_filtered_messages_do_not_count_in_a_burst(play):
    """play/burst_only_filtered_topics"""

    @virtual_time
    async def main():
        messages = [("/b" if n % 2 else "/a", Int64(data=n), n * MS) for n in range(6)]
        playing, got = play.of(messages, topics=["a"], paused=True)
        assert await playing.burst(2) == 2
        return values(got)

    assert main() == [0, 2]


def test_only_what_is_paused_is_stepped(play):
    @virtual_time
    async def main():
        playing, _ = play([0, 100])
        return await playing.play_next(), await playing.burst(3)

    assert main() == (False, 0)


def test_a_clock_set_back_keeps_the_recorded_order(play):
    @virtual_time
    async def main():
        playing, got = play([100, 300, 200, 400])
        assert await playing.play()
        return values(got), ms(got)

    assert main() == ([1, 2, 3, 4], [0, 200, 200, 300])


# Read ahead.


class Held(Bag):
    """A bag whose chunks come when a test says so; it tells in which threads they were read, and how many are open."""

    waits = True

    def __init__(self, path):
        super().__init__(path)
        self.go_on = threading.Event()
        self.threads, self.open = set(), 0

    def entries(self, *arguments, **more):
        self.open += 1
        try:
            self.threads.add(threading.current_thread())
            assert not self.waits or self.go_on.wait(30)
            yield from super().entries(*arguments, **more)
        finally:
            self.open -= 1


@pytest.fixture
def held(record):
    return Held(record([("/a", Int64(data=n), n * MS) for n in range(5000)]))


def test_a_slow_chunk_does_not_block_the_loop(held):
    async def main():
        tape = OrderedMessages(held, held.channels, threaded=True)
        looking = asyncio.create_task(tape.look())
        another = asyncio.create_task(tape.look())
        await asyncio.sleep(0)
        assert not looking.done()
        held.go_on.set()  # the loop is here to say so
        assert await looking is await another
        got = []
        while await tape.look() is not None:
            got.append(tape.take().log_time_ns)
        assert got == [n * MS for n in range(5000)]
        await tape.close()

    asyncio.run(asyncio.wait_for(main(), 60))
    assert threading.main_thread() not in held.threads
    assert held.open == 0


def test_no_more_is_read_ahead_than_is_said(held):
    held.go_on.set()

    async def main():
        tape = OrderedMessages(held, held.channels, threaded=True)
        await tape.look()
        await asyncio.wait([tape._reading])
        ahead = len(tape._ready) + len(tape._reading.result()[0])
        await tape.close()
        return ahead

    assert 1000 < asyncio.run(main()) < 2100
    assert held.open == 0


def test_messages_read_before_a_seek_are_discarded(held):
    async def main():
        tape = OrderedMessages(held, held.channels, threaded=True)
        looking = asyncio.create_task(tape.look())
        await asyncio.sleep(0)
        tape.seek(4000 * MS)
        held.go_on.set()
        found = await looking
        await tape.close()
        return found.log_time_ns

    assert asyncio.run(asyncio.wait_for(main(), 60)) == 4000 * MS
    assert held.open == 0


@pytest.fixture
def player(record, monkeypatch):
    monkeypatch.setattr(player_module, "Bag", Held)
    monkeypatch.setattr(Held, "waits", False)
    return Player(file=record([("/a", Int64(data=n), n * MS) for n in range(50)]))


def test_simulated_time_has_no_thread(player):
    @virtual_time
    async def main():
        async with harness(player) as lab:
            await lab.advance(1)
            assert len(lab.received("a")) == 50

    main()
    assert player._bag.threads == {threading.main_thread()}
    assert player._bag.open == 0


def test_the_system_s_time_has_one(player):
    assert busflow.run(busflow.supervised(player, on_exit="shutdown")) == 0
    assert player.playing.played == 50
    assert threading.main_thread() not in player._bag.threads
    assert player._bag.open == 0
