"""A client's publisher reaches subscriptions, waits for them, and keeps messages if its QoS is transient_local."""

from typing import Any

import pytest

from busflow import Durability, Node, QoS, subscription
from busflow.errors import MalformedMessage
from busflow.msgs.std_msgs import Int64
from busflow.wire.client.known_type import known_type
from busflow.wire.zenoh.qos_text import to_text

pytestmark = pytest.mark.asyncio

LATCHED = QoS(durability=Durability.TRANSIENT_LOCAL, depth=2)


class Sink(Node):
    received: tuple[int, ...] = ()

    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        self.received += (number.data,)


async def int64(looked: Any) -> Any:
    return await looked.ask(known_type, looked.peer, "std_msgs/msg/Int64")


async def test_a_misfit_value_is_refused_uncounted(looked_at: Any):
    async with looked_at(Sink) as looked:
        with looked.peer.advertise("/numbers", await int64(looked), settle=False) as speaker:
            with pytest.raises(MalformedMessage, match="data"):
                speaker.publish({"data": "three"})
            assert speaker.published == 0


async def test_a_subscription_ends_the_wait(looked_at: Any):
    async with looked_at(Sink) as looked:
        type_ = await int64(looked)
        with looked.peer.advertise("/other", type_, settle=False) as speaker:
            assert not await looked.ask(speaker.wait_for_listener, 0)
            looked.graph.subscribe(Int64, "other")
            assert await looked.ask(speaker.wait_for_listener, 60)
        with looked.peer.advertise("/numbers", type_, settle=False) as speaker:
            assert await looked.ask(speaker.wait_for_listener, 60)


async def test_kept_messages_reach_late_subscriptions(looked_at: Any):
    async with looked_at(Sink) as looked:
        with looked.peer.advertise("/map", await int64(looked), qos=to_text(LATCHED), settle=False) as speaker:
            for number in range(3):
                speaker.publish({"data": number})
            await looked.ask(looked.peer.settle)
            late = looked.graph.subscribe(Int64, "map", qos=LATCHED)
            assert [(await anext(late)).data for _ in range(2)] == [1, 2]
