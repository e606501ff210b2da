"""Tests of `clock.py`: exact arithmetic with rclpy's rules, and the clocks' promises."""

import asyncio
import builtins
import copy
import itertools
import math
import operator
import pickle
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.clock import INFINITE, SIM_EPOCH_NS, ClockType, Duration, SimClock, SystemClock, Time
from busflow.errors import NotRunning
from busflow.testing import virtual_time
from tests.vectors import each_case

OPERATORS = {"+": operator.add, "-": operator.sub, "*": operator.mul, "==": operator.eq, "!=": operator.ne}
OPERATORS |= {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
NUMBERS = {
    "inf": math.inf,
    "nan": math.nan,
    "NaN": math.nan,
    "-2**63/1e9": -(2**63) / 1e9,
    "-2**63/1e9 - 1": -(2**63) / 1e9 - 1,
}


def value(text):
    """A number that JSON could not hold, or a clock type's name, or what was given."""
    if isinstance(text, str):
        return NUMBERS.get(text) or ClockType.__members__.get(text, text.removesuffix(" (str)"))
    return text


def operand(given):
    if not isinstance(given, dict):
        return value(given)
    if "Duration_ns" in given:
        return Duration(value(given["Duration_ns"]))
    return Time(given["Time_ns"], clock_type=ClockType[given["clock"]])


def check(expect, act):
    """Run the act and compare with a case's expectation, an error included."""
    if isinstance(expect, dict) and "raises" in expect:
        with pytest.raises(getattr(builtins, expect["raises"])):
            act()
        return
    result = act()
    if isinstance(expect, bool):
        assert result is expect
    elif expect == {"Duration": "Infinite"}:
        assert result == INFINITE
        assert str(result) == "Infinite"
    else:
        assert result.nanoseconds == next(expect[key] for key in ("ns", "Duration_ns", "Time_ns") if key in expect)
        assert isinstance(result, Time) == ("Time_ns" in expect) or "ns" in expect
        if "clock" in expect:
            assert result.clock_type is ClockType[expect["clock"]]


@each_case("e_time_duration_clock", "Time/", "Duration/")
def test_times_and_durations_are_made_as_in_rclpy(case):
    make = {"Time": Time, "Duration": Duration}[case["kind"]]
    check(case["expect"], lambda: make(**{key: value(text) for key, text in case["input"].items()}))


@each_case("e_time_duration_clock", "op/", "cmp/")
def test_arithmetic_and_comparison_agree_with_rclpy(case):
    left, right = operand(case["input"]["l"]), operand(case["input"]["r"])
    check(case["expect"], lambda: OPERATORS[case["input"]["op"]](left, right))


@each_case("e_time_duration_clock", "msg_roundtrip/")
def test_a_message_keeps_every_nanosecond(case):
    before = operand(case["input"])
    after = type(before).from_msg(before.to_msg())
    assert after == before
    assert after.nanoseconds == case["expect"]["ns"]
    if "clock_default" in case["expect"]:
        assert after.clock_type is ClockType[case["expect"]["clock_default"]]
        assert Time.from_msg(before.to_msg(), ClockType.SYSTEM_TIME).clock_type is ClockType.SYSTEM_TIME


@each_case("e_time_duration_clock", "seconds_nanoseconds/")
def test_seconds_and_nanoseconds_add_up(case):
    assert list(Time(**case["input"]).seconds_nanoseconds()) == case["expect"]


@each_case("e_time_duration_clock", "Clock/")
def test_a_clock_type_is_not_a_word(case):
    check(case["expect"], lambda: Time(clock_type=value(case["input"]["clock_type"])))


@each_case("e_time_duration_clock", "Clock.now/")
def test_the_system_clock_goes_forward(case):
    clock = SystemClock()
    seen = [clock.monotonic_ns() for _ in range(case["expect"]["strictly_increasing"])]
    assert all(before < after for before, after in itertools.pairwise(seen))
    assert clock.now().clock_type is ClockType.ROS_TIME
    assert clock.seconds() >= 0


ns = st.integers(-(2**63), 2**63 - 1)


@given(ns, ns)
def test_durations_are_integers(a, b):
    if -(2**63) <= a + b < 2**63:
        assert Duration(a) + Duration(b) == Duration(b) + Duration(a) == Duration(a + b)
        assert (Duration(a) + Duration(b)) - Duration(b) == Duration(a)
    else:
        with pytest.raises(OverflowError, match="292 years"):
            Duration(a) + Duration(b)
    assert (Duration(a) <= Duration(b), Duration(a) > Duration(b)) == (a <= b, a > b)


@given(st.integers(0, 2**63 - 1), st.integers(0, 2**63 - 1))
def test_a_difference_leads_back(a, b):
    assert Time(a) + (Time(b) - Time(a)) == Time(b)
    assert (hash(Time(a)) == hash(Time(b))) == (a == b)


@given(st.integers(0, 2**62).map(lambda number: number / 1e9))
def test_seconds_are_rounded_to_the_nearest_nanosecond(seconds):
    assert abs(Duration(seconds=seconds).nanoseconds - seconds * 1e9) <= max(0.5, seconds * 1e9 * 2**-52)


def test_numbers_of_numpy_keep_their_size():
    assert Duration(seconds=np.int32(5)) == Duration(seconds=5)
    assert Duration(seconds=np.float32(0.5)) == Duration(seconds=0.5)


@pytest.mark.parametrize("seconds", [math.nan, math.inf])
def test_a_time_has_a_finite_number_of_seconds(seconds, golden):
    with golden.raises(OverflowError):
        Time(seconds=seconds)


def test_a_time_is_a_value():
    time = Time(5, clock_type=ClockType.STEADY_TIME)
    for twin in (copy.deepcopy(time), pickle.loads(pickle.dumps(time))):  # noqa: S301 - our own bytes
        assert twin == time
        assert twin.clock_type is ClockType.STEADY_TIME
    with pytest.raises(AttributeError):
        time.nanoseconds = 6


@pytest.mark.parametrize("factor", ["x", None, Duration(2)])
def test_a_duration_is_multiplied_with_numbers_alone(factor):
    with pytest.raises(TypeError):
        Duration(1) * factor


def test_system_clock_calls_in_deadline_order():
    async def main():
        clock, calls, done = SystemClock(), [], asyncio.Event()
        start = clock.monotonic_ns()

        def call(name, due):
            calls.append((name, clock.monotonic_ns() - due >= -10))

        clock.call_at(start + 2_000_000, lambda: (call("last", start + 2_000_000), done.set()))
        clock.call_at(start + 1_000_000, lambda: call("second", start + 1_000_000))
        clock.call_at(0, lambda: call("long due", 0))
        cancelled = clock.call_at(start + 1_500_000, lambda: call("cancelled", 0))
        cancelled.cancel()
        await done.wait()
        return calls

    assert asyncio.run(main()) == [("long due", True), ("second", True), ("last", True)]


@pytest.mark.parametrize("seconds", [0, -1, -math.inf, -1e300])
def test_sleep_of_zero_or_less_yields_once(seconds):
    async def main():
        order = []

        async def other():
            order.append("other")

        task = asyncio.create_task(other())
        await SystemClock().sleep(seconds)
        order.append("slept")
        await task
        return order

    assert asyncio.run(main()) == ["other", "slept"]


def test_sleeping_for_nan_is_refused():
    with pytest.raises(ValueError, match="NaN"):
        asyncio.run(SystemClock().sleep(math.nan))


@each_case("e_time_duration_clock", "sleep_for/", "sleep_until/")
def test_sleep_lasts_as_long_as_asked(case):
    """On virtual time: exactly as long as asked, where ROS promises at least as long."""
    given, expect = case["input"], case["expect"]

    @virtual_time
    async def sleep():
        clock = SimClock()
        if "until_clock" in given:
            with pytest.raises(ValueError, match=expect["message_contains"]):
                await clock.sleep_until(Time(0, clock_type=ClockType[given["until_clock"]]))
        elif case["kind"] == "sleep_for":
            await clock.sleep(given["s"])
        else:
            await clock.sleep_until(Time(clock.now().nanoseconds + round(given["offset_s"] * 1e9)))
        return clock.seconds()

    slept = sleep()
    assert slept == max(0, expect.get("elapsed_at_least_s", 0))
    assert slept < expect.get("elapsed_below_s", math.inf)


def test_a_simulated_clock_says_what_it_needs():
    async def main():
        with pytest.raises(NotRunning, match="virtual_time"):
            SimClock()

    asyncio.run(main())
    assert SIM_EPOCH_NS > 0


def test_importing_the_clock_is_cheap():
    code = "import busflow.clock, sys; print(sys.modules.keys() & {'pydantic', 'numpy', 'anyio'})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "set()"
