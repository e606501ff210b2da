"""A type that the run does not use is one of busflow's own, if its hash is that one's."""

from typing import Any

import pytest

from busflow import Message, Node, publisher
from busflow.errors import UnknownType
from busflow.interfaces.field_types import float64
from busflow.wire.client.known_type import known_type

pytestmark = pytest.mark.asyncio

OTHER_HASH = "RIHS01_" + "0" * 64


class Grip(Message):
    force: float64


class Hand(Node):
    grips = publisher(Grip, "grips")


async def test_a_type_of_the_run_is_found(looked_at: Any):
    async with looked_at(Hand) as looked:
        found = await looked.ask(known_type, looked.peer, Grip.__ros_name__)
    assert found.decode(found.encode({"force": 2.5})) == {"force": 2.5}


async def test_an_unused_type_is_busflows_own(looked_at: Any):
    async with looked_at(Hand) as looked:
        found = await looked.ask(known_type, looked.peer, "std_msgs/msg/Bool")
        same = await looked.ask(known_type, looked.peer, "std_msgs/msg/Bool", found.type_hash)
    assert (same.name, same.type_hash) == ("std_msgs/msg/Bool", found.type_hash)
    assert found.decode(found.encode({"data": True})) == {"data": True}


@pytest.mark.parametrize(
    ("name", "type_hash", "why"),
    [
        ("Bool", None, "no type 'Bool'"),
        ("std_msgs/msg/Boool", None, "no type 'std_msgs/msg/Boool'; did you mean 'std_msgs/msg/Bool'"),
        ("std_srvs/srv/Trigger", None, "std_srvs/srv/Trigger is a service; messages have a topic"),
        ("std_msgs/msg/Bool", OTHER_HASH, "std_msgs/msg/Bool is another version than busflow's"),
    ],
)
async def test_an_unknown_type_is_refused(looked_at: Any, name: str, type_hash: str | None, why: str):
    async with looked_at(Hand) as looked:
        with pytest.raises(UnknownType, match=why):
            await looked.ask(known_type, looked.peer, name, type_hash)
