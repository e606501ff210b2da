"""Tests of `topic.py`: late joiners, deadlines, taps and successors."""

import asyncio
import re
from types import SimpleNamespace

import pytest

from busflow.bus.qos import Overflow
from busflow.msgs.std_msgs import Int64
from busflow.testing import virtual_time
from tests.bus.conftest import publish
from tests.vectors import each_case


async def taken(subscription):
    """Everything that waits, taken one by one."""
    values = []
    while subscription.queue.items:
        values.append((await anext(subscription)).data)
    return values


def numbers(text):
    """The numbers of `publish 1..5 without reading`, or of `publish 6`."""
    first, last = re.match(r"publish (\d+)(?:\.\.(\d+))?", text).groups()
    return range(int(first), int(last or first) + 1)


@each_case("c_history", "ring/new", "ring/overwrite")
@virtual_time
async def test_full_queue_keeps_the_newest(make_bench, case):
    bench = make_bench()
    publisher = bench.publisher()
    subscription = bench.subscription(depth=case["given"]["capacity"])
    for step in case["steps"]:
        if step != "create":
            publish(publisher, ord(step[1]))
    expect = case["expect"]
    assert subscription.queue.full == expect["is_full"]
    snapshot = [chr(message.data) for message in subscription.queue.items]
    assert snapshot == expect.get("snapshot", [])
    assert [chr(value) for value in await taken(subscription)] == expect.get("then get", [])
    assert len(subscription.queue) == 0


@each_case("c_history", "model/keep_last", "zenoh/ring-3-of-10")
@virtual_time
async def test_depth_limits_what_is_kept(make_bench, case):
    bench = make_bench()
    publisher = bench.publisher()
    subscription = bench.subscription(depth=case["given"]["depth"])
    values = range(10) if case["id"].startswith("zenoh") else numbers(case["steps"][0])
    publish(publisher, *values)
    expected = [int(str(text).removeprefix("put")) for text in case["expect"]["received"]]
    assert await taken(subscription) == expected
    assert subscription.statistics().dropped == case["expect"].get("dropped", len(values) - len(expected))


@each_case("c_history", "model/transient_local", "model/volatile")
@virtual_time
async def test_late_joiner_gets_what_is_kept(make_bench, case):
    bench, given = make_bench(), case["given"]
    before, _, after = case["steps"]
    publisher = bench.publisher(depth=given["depth"], durability=given["durability"])
    publish(publisher, *numbers(before))
    late = bench.subscription(depth=given["depth"] + 1, durability=given["durability"])
    publish(publisher, *numbers(after))
    assert await taken(late) == case["expect"]["received"]
    assert late.queue.dropped == 0


@each_case("c_history", "zenoh/history-cache-3", "rmw_zenoh/transient_local-cache-is-depth")
@virtual_time
async def test_late_joiner_receives_history_then_new_messages(make_bench, case):
    bench, given = make_bench(), case["given"]
    publisher = bench.publisher(depth=given.get("publisher_cache", given.get("depth")), durability="transient_local")
    first = [int(value) for value in case["steps"][0][1:]] if "zenoh/h" in case["id"] else range(1, 10)
    publish(publisher, *first)
    late = bench.subscription(durability="transient_local")
    if len(case["steps"]) > 2:
        publish(publisher, *map(int, case["steps"][2][1:]))
    assert await taken(late) == [int(value) for value in case["expect"]["received"]]


@each_case("c_history", "lifespan/")
@virtual_time
async def test_expired_messages_are_not_delivered(make_bench, case):
    bench, given, received = make_bench(), case["given"], []
    limits = {"durability": given["durability"], "depth": given["depth"]}
    publisher = bench.publisher(**limits, lifespan_s=given["lifespan_s"])
    for tick in range(80):  # the subscription is there for two seconds, and away for two
        if tick % 32 == 0:
            subscription = bench.subscription(lambda message: received.append(message.data), **limits)
        if tick % 32 == 16:
            subscription.close()
        publish(publisher, tick)
        await asyncio.sleep(given["publish_period_s"])
    assert publisher.published * 2 / 5 < len(received) < publisher.published
    assert received == sorted(set(received))
    assert bench.balanced()


@each_case("c_history", "deadline/")
@virtual_time
async def test_missed_deadline_is_an_event_on_both_sides(make_bench, case):
    bench, counts = make_bench(), {}
    ends = {"publisher": bench.publisher(deadline_s=1), "subscriber": bench.subscription(deadline_s=1)}
    for side, end in ends.items():
        end.on_event = lambda event, side=side: counts.setdefault(side, []).append(event.count)
    for toggle in range(5):
        for _ in range(8):
            if toggle % 2 == 0:
                publish(ends["publisher"], 1)
            await asyncio.sleep(0.25)
    assert counts == {"publisher": [1, 2, 3, 4], "subscriber": [1, 2, 3, 4]}
    assert case["expect"]["last total_count == 4"]


# Beyond the cases.


@virtual_time
async def test_failing_tap_is_logged_once_and_removed(make_bench):
    bench, contexts, received = make_bench(), [], []
    asyncio.get_running_loop().set_exception_handler(lambda _loop, context: contexts.append(context))
    publisher, subscription = bench.publisher(), bench.subscription()
    topic = bench.bus.topics["/number"]

    def broken(message):
        raise ValueError(message.data)

    bench.bus.tap(topic, broken)
    bench.bus.tap(topic, lambda message: received.append(message.data))
    for value in (1, 2):
        publisher.publish(Int64(data=value))
    assert received == [1, 2]
    assert [message.data for message in subscription.queue.items] == [1, 2]
    assert bench.balanced()
    [context] = contexts
    assert (topic.name in context["message"], str(context["exception"])) == (True, "1")


@virtual_time
async def test_tap_that_removes_itself_may_raise(make_bench):
    bench, contexts = make_bench(), []
    asyncio.get_running_loop().set_exception_handler(lambda _loop, context: contexts.append(context))
    publisher = bench.publisher()
    topic = bench.bus.topics["/number"]

    def once(_message):
        bench.bus.untap(topic, once)
        raise ValueError("enough")

    bench.bus.tap(topic, once)
    for value in (1, 2):
        publisher.publish(Int64(data=value))
    assert [str(each["exception"]) for each in contexts] == ["enough"]
    assert topic.taps == []


@each_case("c_history", "matched-event/")
@virtual_time
async def test_publisher_gets_each_match_event(make_bench, case):
    bench, events = make_bench(), []
    publisher = bench.publisher()
    publisher.on_event = events.append
    subscription = bench.subscription()
    subscription.close()
    events = [
        {
            "total": event.total,
            "total_change": event.total_change,
            "current": event.current,
            "current_change": event.current_change,
        }
        for event in events
    ]
    assert events == case["expect"]["events"]


@pytest.mark.parametrize("overflow", Overflow)
@virtual_time
async def test_messages_dropped_on_their_way_are_overflow(make_bench, overflow):
    bench = make_bench()
    publisher, subscription = bench.publisher(), bench.subscription(depth=2, overflow=overflow)
    publish(publisher, 1, 2)
    bench.bus.topics["/number"].count_overflow(publisher, 3)
    assert (subscription.published, subscription.drops["overflow"]) == (5, 3)
    assert await taken(subscription) == [1, 2]
    assert bench.balanced()


@virtual_time
async def test_reader_and_reason_of_lost_messages_are_known(make_bench):
    bench = make_bench()
    bench.publisher()
    subscription = bench.subscription()
    topic = bench.bus.topics["/number"]
    for reason, count in (("link", 3), ("end", 2), ("link", -1)):
        topic.count_lost(reason, count)
    found = topic.statistics()
    assert (found.losses, found.subscriptions[0].lost) == ({"lost": 4}, {"link": 2, "end": 2})
    assert found.subscriptions[0].as_json()["lost"] == {"link": 2, "end": 2}
    late = bench.subscription(node="/late")
    topic.count_lost("link", -2)
    topic.count_lost("end", -2)
    assert (topic.statistics().losses, subscription.statistics().lost, late.statistics().lost) == ({}, {}, {})
    assert "lost" not in topic.statistics().subscriptions[0].as_json()


@virtual_time
async def test_newest_suffice_while_nothing_wants_older_messages(make_bench):
    bench = make_bench()
    bench.subscription(depth=3)
    topic = bench.bus.topics["/number"]
    deep, tap = bench.subscription(depth=5), bench.bus.tap
    assert topic.keeps_newest == 5
    bench.bus.keep_recent(topic, 9)
    assert topic.keeps_newest == 9
    tap(topic, print)
    assert topic.keeps_newest is None
    bench.bus.untap(topic, print)
    deep.link = SimpleNamespace(held=0)
    assert topic.keeps_newest is None
    deep.close()
    assert topic.keeps_newest == 9
    bench.subscription(overflow=Overflow.DROP_NEWEST)
    assert topic.keeps_newest is None
