"""Tests of `statistics.py`: every object of a running graph reports its counts; reading changes nothing."""

import json
from collections import Counter
from dataclasses import FrozenInstanceError, replace

import pytest

from busflow import Node, QoS, client, publisher, service, subscription, timer
from busflow.bus.inbox import Inbox
from busflow.bus.qos import Overflow
from busflow.bus.statistics import (
    ClientStatistics,
    DispatcherStatistics,
    InboxStatistics,
    PublisherStatistics,
    ServerStatistics,
    ServiceStatistics,
    SubscriptionStatistics,
    TimerStatistics,
    TopicStatistics,
    added,
    reasons_text,
)
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import Trigger
from busflow.node.node import runtime_of
from busflow.testing import harness, virtual_time

LINE = SubscriptionStatistics("/sink", "/number", 5, Overflow.DROP_OLDEST, 9, 4, 3, 2, {"overflow": 3}, 1)


@virtual_time
async def test_dispatcher_statistics_count_the_ready(make_bench):
    bench = make_bench()
    assert bench.bus.dispatcher.statistics() == DispatcherStatistics(ready=0, quantum=8)
    source = bench.publisher()
    bench.subscription(lambda _message: None)
    source.publish(Int64(data=1))
    assert bench.bus.dispatcher.statistics().ready == 1


@virtual_time
async def test_inbox_statistics_count_waiting_and_dropped(make_bench):
    inbox = Inbox(make_bench().bus.dispatcher)
    inbox.put(Counter(), lambda: None)
    assert inbox.statistics() == InboxStatistics(taken=0, dropped=0, refused=0, waiting=1)
    inbox.close()
    assert inbox.statistics() == InboxStatistics(taken=0, dropped=1, refused=0, waiting=0)


class Asker(Node):
    numbers = publisher(Int64, "numbers", QoS(depth=1))
    ask = client(Trigger, "answer")

    @timer(1.0)
    async def tick(self) -> None:
        await self.ask.call()
        self.numbers.publish(Int64(data=1))


class Answerer(Node):
    @service(Trigger, "answer")
    def on_answer(self, _request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)

    @subscription("numbers")
    def on_number(self, number: Int64) -> None: ...


@virtual_time
async def test_bus_and_node_statistics_agree():
    async with harness(Asker, Answerer) as lab:
        await lab.advance(3.5)
        found = lab.graph.bus.statistics()
        asker, answerer = (runtime_of(lab.graph.node(kind)).statistics() for kind in (Asker, Answerer))
        (numbers,) = [each for each in found.topics if each.topic == "/numbers"]
        assert (numbers.publishers, numbers.subscriptions) == (asker.publishers, answerer.subscriptions)
        assert (numbers.published, numbers.subscriptions[0].delivered) == (3, 3)
        (answers,) = [each for each in found.services if each.service == "/answer"]
        assert (answers.servers, answers.clients) == (answerer.servers, asker.clients)
        assert (answers.servers[0].served, answers.clients[0].answered) == (3, 3)
        assert ([each.fired for each in asker.timers], asker.tasks, asker.parameters_set) == ([3], 0, 0)
        assert found.inbox == lab.graph.bus.inbox.statistics()
        assert found == lab.graph.bus.statistics()


def test_accounts_of_successive_starts_add_up():
    later = replace(LINE, depth=7, published=4, delivered=1, dropped=2, queued=1, drops={"expired": 2})
    assert LINE + later == SubscriptionStatistics(
        "/sink", "/number", 7, Overflow.DROP_OLDEST, 13, 5, 5, 3, {"overflow": 3, "expired": 2}, 2
    )
    served = ServerStatistics("/s", "/do", 10, 6, 1, 1, 1, 1, 1, 1)
    assert served + served == ServerStatistics("/s", "/do", 10, 12, 2, 2, 2, 2, 2, 2)
    called = ClientStatistics("/c", "/do", 4, 1, 1, 1, 1, 1, {"ServiceTimeout": 1})
    assert called + called == ClientStatistics("/c", "/do", 8, 2, 2, 2, 2, 2, {"ServiceTimeout": 2})


def test_topics_of_two_processes_add_up_end_by_end():
    second, elsewhere = replace(LINE, published=1, delivered=0, dropped=0, queued=1, drops={}), replace(LINE, node="/b")
    sender = PublisherStatistics("/source", "/number", 5, 0, 1, True, 0, 0)
    here = TopicStatistics("/number", "a/msg/B", 9, 4, 2.5, {"lost": 1}, (LINE, second), (sender,))
    there = TopicStatistics("/number", "a/msg/B", 3, 1, 1.5, {"lost": 2, "early": 1}, (second, elsewhere), (sender,))
    (found,) = added([here], [there])
    assert found.name == "/number"
    assert (found.published, found.arrived, found.since_s, found.losses) == (12, 5, 1.5, {"lost": 3, "early": 1})
    assert found.subscriptions == (LINE + second, second, elsewhere)
    assert found.publishers == (PublisherStatistics("/source", "/number", 10, 0, 2, True, 0, 0),)


def test_topic_of_a_run_counts_a_message_once():
    here, there = TopicStatistics("/number", "a/msg/B", 5), TopicStatistics("/number", "a/msg/B", 5, arrived=5)
    assert TopicStatistics.of_run([here, there]) == here
    more = replace(there, published=6, arrived=6)  # one of the six came from outside the run
    assert TopicStatistics.of_run([here, more]) == replace(here, published=6)


def test_entry_of_a_report_has_all_that_adds_up():
    topic = TopicStatistics("/number", "a/msg/B", 9, 4, 2.5, {"lost": 1}, (replace(LINE, deadlines_missed=0),))
    entry = json.loads(json.dumps(topic.as_json()))
    assert list(entry) == ["name", "type", "published", "arrived", "since_s", "losses", "subscriptions"]
    assert entry["subscriptions"][0]["overflow"] == "drop_oldest"
    assert TopicStatistics.from_json(entry | {"a key of later versions": 1}) == topic
    do = ServiceStatistics("/do", "a/srv/Do", (), (ClientStatistics("/c", "/do", 4, 1, 1, 1, 1, 1, {}),))
    assert (do.name, list(do.as_json()), do.as_json()["clients"][0]["called"]) == (
        "/do",
        ["name", "type", "servers", "clients"],
        4,
    )


def test_services_and_timers_of_two_processes_add_up_by_name():
    served = ServerStatistics("/s", "/do", 10, 6, 1, 1, 1, 1, 1, 1)
    called = ClientStatistics("/c", "/do", 4, 1, 1, 1, 1, 1, {})
    do = ServiceStatistics("/do", "a/srv/Do", (served,), (called,))
    other = replace(do, service="/other")
    assert added([do], [other, replace(do, clients=(replace(called, node="/d"),))]) == (
        ServiceStatistics("/do", "a/srv/Do", (served + served,), (called, replace(called, node="/d"))),
        other,
    )
    tick = TimerStatistics("/s", "tick", 1.0, 3, 1, 0.1, 0.2)
    later = TimerStatistics("/s", "tick", 2.0, 4, 0, None, 0.3)
    assert added([tick], [], [later]) == (TimerStatistics("/s", "tick", 2.0, 7, 1, None, 0.3),)


def test_statistics_cannot_be_changed():
    with pytest.raises(FrozenInstanceError):
        LINE.published = 0


def test_reasons_are_listed_with_their_counts():
    assert reasons_text({"link": 2, "end": 1}) == "2 link, 1 end"
