"""Calls as the messages of ROS 2's service introspection."""

import asyncio
from types import SimpleNamespace
from typing import Any

from busflow.bus.services.call import Call
from busflow.clock import Time
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import type_name
from busflow.msgs.std_srvs import SetBool
from busflow.runner.service_events import event_class, event_message, is_elsewhere


def test_event_type_is_that_of_ros2():
    cls = event_class(SetBool)
    assert cls is event_class(SetBool), "two topics of one type have one class"
    fields = TypeSupport(cls).description["type_description"]["fields"]
    nested = ["service_msgs/msg/ServiceEventInfo", "std_srvs/srv/SetBool_Request", "std_srvs/srv/SetBool_Response"]
    assert (type_name(cls), [each["type"]["nested_type_name"] for each in fields]) == (
        "std_srvs/srv/SetBool_Event",
        nested,
    )


def test_request_and_answer_are_events_and_failure_none():
    async def events():
        answered, failed = (Call("/lamp", number, SetBool.Request(data=True), "/hand") for number in (1, 2))
        yield event_message(event_class(SetBool), answered, Time(nanoseconds=7))
        answered.succeed(SetBool.Response(success=True))
        failed.reply.cancel()
        for call in (answered, failed):
            yield event_message(event_class(SetBool), call, Time(nanoseconds=8))

    async def collected():
        return [each async for each in events()]

    request, response, none = asyncio.run(collected())
    assert (request.info.event_type, request.request, request.response) == (1, (SetBool.Request(data=True),), ())
    assert (response.info.event_type, response.request, response.response[0].success) == (2, (), True)
    assert none is None
    assert bytes(request.info.client_gid) == bytes(response.info.client_gid)


def test_call_elsewhere_is_known_until_it_ends():
    here: Any = SimpleNamespace(server=None)
    elsewhere: Any = SimpleNamespace(server=object())  # whatever answers for another process is no `Server`
    known: set[int] = set()

    async def seen():
        call = Call("/lamp", 1, SetBool.Request(), "/hand")
        yield is_elsewhere(call, here, known)
        yield is_elsewhere(call, elsewhere, known)
        yield is_elsewhere(call, here, known)
        call.succeed(SetBool.Response())
        yield is_elsewhere(call, here, known)

    async def collected():
        return [each async for each in seen()]

    assert asyncio.run(collected()) == [False, True, True, True]
    assert known == set()
