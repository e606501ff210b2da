"""A catalogue offers a run's topics and services under numbers, and says what has come and gone."""

import asyncio
from typing import Any

import pytest

from busflow import Node, publisher, service
from busflow.bus.patterns import Selection
from busflow.errors import NoSuchTarget
from busflow.msgs.rosgraph_msgs import Clock
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import Trigger
from busflow.wire.client.client import Peer
from busflow.wire.zenoh.run_directory import find_run
from busflow_ui.foxglove.catalogue import Catalogue, Change
from tests.golden import Golden

pytestmark = pytest.mark.asyncio


class Counter(Node):
    numbers = publisher(Int64, "numbers")

    @service(Trigger, "reset")
    def on_reset(self, _: Trigger.Request) -> Trigger.Response:
        return Trigger.Response()


def catalogue_of(looked: Any, *patterns: str) -> tuple[Catalogue, list[str]]:
    printed: list[str] = []
    return Catalogue(looked.peer, Selection(patterns), printed.append), printed


async def changed(looked: Any, catalogue: Catalogue) -> Change:
    """The next change that is one."""
    async with asyncio.timeout(60):
        while (change := catalogue.update(await looked.ask(catalogue.look))) == Change():
            pass
    return change


async def test_topics_and_services_have_distinct_numbers(looked_at: Any):
    async with looked_at(Counter) as looked:
        catalogue, printed = catalogue_of(looked)
        change = await changed(looked, catalogue)
        topics = {each.topic.name: each.announcement() for each in change.channels}
        (reset,) = [each.announcement() for each in change.services if each.kind.name == "/reset"]
        assert catalogue.update(await looked.ask(catalogue.look)) == Change(), "the same state changes nothing"
    numbers = topics["/numbers"]
    assert (numbers["topic"], numbers["schemaName"], numbers["encoding"]) == ("/numbers", "std_msgs/msg/Int64", "cdr")
    assert (numbers["schemaEncoding"], numbers["schema"].strip()) == ("ros2msg", "int64 data")
    assert (reset["type"], reset["request"]["schemaName"]) == ("std_srvs/srv/Trigger", "std_srvs/srv/Trigger_Request")
    ids = [*catalogue.channels, *catalogue.services]
    assert len(ids) == len(set(ids)) == len(change.channels) + len(change.services)
    assert printed == []


async def test_a_topic_comes_and_goes(looked_at: Any):
    async with looked_at(Counter) as looked:
        catalogue, _ = catalogue_of(looked, "numbers", "late")
        first = await changed(looked, catalogue)
        other = await looked.ask(lambda: Peer(find_run("looked")))
        try:
            with other.advertise("/late", await looked.ask(looked.peer.type, "std_msgs/msg/Int64"), settle=False):
                came = await changed(looked, catalogue)
            went = await changed(looked, catalogue)
        finally:
            await looked.ask(other.close)
    assert [each.topic.name for each in first.channels] == ["/numbers"]
    assert [each.topic.name for each in came.channels] == ["/late"]
    assert went == Change(gone_channels=(came.channels[0].id,))
    assert list(catalogue.channels) == [first.channels[0].id]


async def test_topic_keeps_its_number_without_publishers(looked_at: Any):
    async with looked_at(Counter) as looked:
        catalogue, _ = catalogue_of(looked, "late")
        late = looked.graph.advertise(Int64, "late")
        (channel,) = (await changed(looked, catalogue)).channels
        late.close()
        changes: list[Change] = []
        while catalogue.channels[channel.id].topic.publishers:
            changes.append(catalogue.update(await looked.ask(catalogue.look)))
    assert changes == [Change()] * len(changes)


async def test_unmatched_pattern_names_the_nearest_topic(looked_at: Any, golden: Golden):
    async with looked_at(Counter) as looked:
        catalogue, _ = catalogue_of(looked, "nmbers")
        seen = await looked.ask(catalogue.look)
        with golden.raises(NoSuchTarget):
            catalogue.require_matches(seen.graph)


async def test_a_published_clock_has_a_channel(looked_at: Any):
    async with looked_at(Counter) as looked:
        catalogue, _ = catalogue_of(looked, "numbers", "clock")
        await changed(looked, catalogue)
        assert catalogue.clock() is None
        looked.graph.advertise(Clock, "clock")
        (channel,) = (await changed(looked, catalogue)).channels
        assert catalogue.clock() is channel
