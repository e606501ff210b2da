"""What a viewer publishes is checked at its beginning, arrives in nodes, and ends with the viewer."""

from typing import Any

import pytest

from busflow import Node, QoS, publisher, subscription
from busflow.commands import TopicView, known_type
from busflow.errors import IncompatibleType, InvalidName, MalformedMessage, NoSuchTarget, UnknownType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import Int64, String
from busflow_ui.foxglove.protocol import ClientChannel
from busflow_ui.foxglove.publications import Publications
from tests.golden import Golden

pytestmark = pytest.mark.asyncio
INT64 = "std_msgs/msg/Int64"


class Sink(Node):
    text = publisher(String, "text")
    received: tuple[int, ...] = ()

    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        self.received += (number.data,)


async def begin(looked: Any, publications: Publications, id_: int, topic: str, encoding: str, *schema: str) -> None:
    """Begin to publish; the schema is the name of a type, and its definition if the viewer has one."""
    graph = await looked.ask(looked.peer.graph)
    await looked.ask(publications.begin, ClientChannel(id_, topic, encoding, *schema), graph)


async def test_messages_of_both_encodings_arrive(looked_at: Any):
    async with looked_at(Sink) as looked:
        publications = Publications(looked.peer)
        await begin(looked, publications, 1, "/numbers", "json", "std_msgs/Int64")
        await begin(looked, publications, 2, "/numbers", "cdr", INT64)
        await looked.ask(looked.peer.settle)
        publications.publish(1, b'{"data": 5}')
        await looked.until(lambda: looked.graph.node(Sink).received)
        publications.publish(2, bytes(TypeSupport(Int64).encode(Int64(data=6))) + bytes(4))
        await looked.until(lambda: looked.graph.node(Sink).received[1:])
        publications.close()
    assert looked.graph.node(Sink).received == (5, 6)


@pytest.mark.parametrize(
    ("channel", "error"),
    [
        (("/a b", "cdr", INT64), InvalidName),
        (("/numbers", "protobuf", INT64), MalformedMessage),
        (("/text", "cdr", INT64), IncompatibleType),
        (("/new", "cdr", "std_msgs/msg/Absent"), UnknownType),
        (("/new", "cdr", "grip_msgs/msg/Grip", "int8"), MalformedMessage),
        (("/new", "cdr", "grip_msgs/msg/*", "int8 a"), UnknownType),
        (("/new", "cdr", "grip_msgs/msg/Grip[2]", "int8 a"), UnknownType),
    ],
)
async def test_impossible_publication_is_refused(
    looked_at: Any, channel: tuple[str, ...], error: type[Exception], golden: Golden
):
    async with looked_at(Sink) as looked:
        publications = Publications(looked.peer)
        with golden.raises(error, mask={"known: .*": "known: …"}):
            await begin(looked, publications, 1, *channel)
        with golden.raises(NoSuchTarget):
            publications.publish(1, b"{}")


async def test_viewers_definition_makes_an_unknown_type(looked_at: Any):
    async with looked_at(Sink) as looked:
        publications = Publications(looked.peer)
        definition = "float32 force\nFinger[] fingers\n===\nMSG: grip_msgs/Finger\nstring name\n"
        await begin(looked, publications, 1, "/grip", "json", "grip_msgs/Grip", definition)
        topic = TopicView("/grip", ("grip_msgs/msg/Grip",), (), ())
        type_ = await looked.ask(lambda: known_type(looked.peer, "grip_msgs/msg/Grip", definition=definition))
        with looked.peer.listen(topic, type_) as listener:
            await looked.ask(looked.peer.settle)
            publications.publish(1, b'{"force": 0.5, "fingers": [{"name": "left"}]}')
            received = await looked.ask(listener.get, 60.0)
        publications.close()
    assert type_.decode(received.payload) == {"force": 0.5, "fingers": ({"name": "left"},)}


async def test_a_number_in_use_is_refused(looked_at: Any, golden: Golden):
    async with looked_at(Sink) as looked:
        publications = Publications(looked.peer)
        await begin(looked, publications, 1, "/new", "json", INT64)
        with golden.raises(MalformedMessage):
            await begin(looked, publications, 1, "/other", "json", INT64)
        publications.end(1)
        await begin(looked, publications, 1, "/other", "json", INT64)
        publications.close()


async def test_a_misfit_subscription_is_named_once(looked_at: Any, golden: Golden):
    async with looked_at(Sink) as looked:
        publications = Publications(looked.peer)
        await begin(looked, publications, 1, "/new", "json", INT64)
        assert list(publications.new_misfits(await looked.ask(looked.peer.graph))) == []
        looked.graph.subscribe(Int64, "new", qos=QoS(deadline=0.5))
        named: list[str] = []
        while not named:
            graph = await looked.ask(looked.peer.graph)
            named += publications.new_misfits(graph)
        golden(named[0])
        assert list(publications.new_misfits(graph)) == []
        publications.close()


async def test_closed_publications_stay_closed(looked_at: Any):
    """Also one that another thread began meanwhile."""
    async with looked_at(Sink) as looked:
        publications = Publications(looked.peer)
        publications.close()
        await begin(looked, publications, 1, "/numbers", "json", INT64)
        with pytest.raises(NoSuchTarget):
            publications.publish(1, b'{"data": 5}')
