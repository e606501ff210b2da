"""The calls of a service as ROS 2's service introspection publishes them, while somebody listens."""

import asyncio
from contextlib import closing

import pytest

from busflow import Node, launch, service
from busflow.errors import ServiceFailed
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.recording.bag.bag import Bag
from busflow.wire.client.client import Peer
from busflow.wire.client.graph_view import TopicView
from busflow.wire.zenoh.run_directory import find_run

pytestmark = pytest.mark.asyncio


class Lamp(Node):
    @service(SetBool, "~/switch")
    def switch(self, request: SetBool.Request) -> SetBool.Response:
        if not request.data:
            raise ValueError("it stays on")
        return SetBool.Response(success=True, message="on")

    @service(Trigger, "~/dim")
    def dim(self, _request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response()


async def test_calls_are_published_for_another_process(looked_at):
    async with looked_at(Lamp) as looked:
        graph, peer = looked.graph, looked.peer
        kind = await looked.ask(peer.service, "/lamp/switch", events=True)
        topic = TopicView("/lamp/switch/_service_event", (kind.event.name,), (), ())
        with peer.listen(topic, kind.event) as listener:
            await looked.until(lambda: topic.name in graph.bus.topics and graph.bus.topics[topic.name].publishers)
            await looked.ask(peer.settle)
            await graph.call(SetBool, "lamp/switch", SetBool.Request(data=True))
            with pytest.raises(ServiceFailed):
                await graph.call(SetBool, "lamp/switch", SetBool.Request(data=False))
            await graph.call(Trigger, "lamp/dim")
            found = [await looked.ask(listener.get, 60) for _ in range(3)]
            assert listener.get(0) is None
        events = [kind.event.decode(each.payload) for each in found]
        assert [event["info"]["event_type"] for event in events] == [1, 2, 1]
        assert [event["info"]["sequence_number"] for event in events] == [1, 1, 2]
        assert [list(event["request"]) for event in events] == [[{"data": True}], [], [{"data": False}]]
        assert list(events[1]["response"]) == [{"success": True, "message": "on"}]
        await looked.until(lambda: not graph.bus.topics[topic.name].publishers)
        assert graph.bus.services["/lamp/switch"].taps == []


async def test_recording_has_each_call_once(tmp_path):
    wanted = {"to": str(tmp_path / "run.mcap"), "topics": ["/lamp/dim/_service_event"]}
    async with launch(Lamp, inspect="recorded", record=wanted) as graph:
        with closing(await asyncio.to_thread(lambda: Peer(find_run("recorded")))) as peer:
            kind = await asyncio.to_thread(lambda: peer.service("/lamp/dim", events=True))
            topic = TopicView("/lamp/dim/_service_event", (kind.event.name,), (), ())
            with peer.listen(topic, kind.event) as listener:
                await asyncio.to_thread(peer.settle)
                await graph.call(Trigger, "lamp/dim")
                assert await asyncio.to_thread(listener.get, 60) is not None
    with Bag(tmp_path / "run.mcap") as bag:
        assert len(list(bag.entries(["/lamp/dim/_service_event"]))) == 2


async def test_services_of_every_node_have_no_events(looked_at):
    async with looked_at(Lamp) as looked:
        for name in ("/lamp/get_logger_levels", "/lamp/dim"):
            kind = await looked.ask(looked.peer.service, name, events=True)
            assert (kind.event is None) == (name != "/lamp/dim")
