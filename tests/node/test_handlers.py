"""Handlers of services: what their annotations must say, and what is wrong where it is written."""

from __future__ import annotations

import pytest

from busflow import Node, ServiceType, client, on_event, service, subscription, timer
from busflow.errors import InvalidDeclaration
from busflow.interfaces.message import Message
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.node.declarations import PullDeclaration
from busflow.node.handlers import Handler, ServiceRole, declarations_of
from busflow.testing import harness, virtual_time


class Base(Node):
    reset = client(Trigger, "reset")

    @service(Trigger, "~/one", depth=3)
    @service(Trigger, "~/two")
    def on_reset(self, _request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(message=type(self).__name__)


def test_a_class_shows_its_services_without_an_instance():
    assert (Base.reset.type, Base.reset.service) == (Trigger, "reset")
    assert isinstance(Base.on_reset, Handler)
    assert Base.on_reset.roles == (ServiceRole(Trigger, "~/one", 3), ServiceRole(Trigger, "~/two", 10))


@virtual_time
async def test_an_override_keeps_services_of_stacked_decorators():
    class Derived(Base):
        reset = None

        def on_reset(self, request):
            return super().on_reset(request).replace(success=True)

    assert set(declarations_of(Derived)) == {"on_reset"}
    async with harness(Derived) as lab:
        for name in ("derived/one", "derived/two"):
            assert await lab.call(Trigger, name) == Trigger.Response(success=True, message="Derived")
        assert lab.node(Derived).on_reset(Trigger.Request()).success, "on an instance it is the method"


def test_a_service_of_the_surrounding_function_is_resolved():
    class Local(ServiceType, package="test"):
        class Request(Message):
            pass

        class Response(Message):
            pass

    class Answering(Node):
        @service(Local, "local")
        def on_local(self, request: Local.Request) -> Local.Response: ...

    Answering.on_local.check_service(Local)


def wrong(annotations, arguments="self, request"):
    names = {}
    exec(f"def on_reset({arguments}): ...", names)  # noqa: S102  # a signature as text
    names["on_reset"].__annotations__ = annotations
    names["on_reset"].__globals__.update(Trigger=Trigger, SetBool=SetBool)
    handler = service(Trigger, "reset")(names["on_reset"])
    handler.__set_name__(Base, "on_reset")
    with pytest.raises(InvalidDeclaration) as caught:
        handler.check_service(Trigger)
    return str(caught.value)


WRITE = (
    "Base.on_reset answers std_srvs/srv/Trigger: "
    "write def on_reset(self, request: Trigger.Request) -> Trigger.Response; it "
)


def test_annotations_of_another_type_are_refused_with_advice():
    assert wrong({"request": SetBool.Request}).startswith(f"{WRITE}takes <class ")
    assert wrong({"request": "Trigger.Response"}).startswith(f"{WRITE}takes <class ")
    assert wrong({"return": "SetBool.Response"}).startswith(f"{WRITE}returns <class ")
    assert wrong({"return": None}) == f"{WRITE}returns None"
    assert "'Nothing' is not defined" in wrong({"request": "Nothing.Request"})


@pytest.mark.parametrize("arguments", ["self", "self, request, response", "request"])
def test_a_handler_that_accepts_no_request_is_refused(arguments, golden):
    """As a handler of rclpy, which is given the response to fill in."""
    golden(wrong({}, arguments))


@pytest.mark.parametrize("arguments", ["self, request, more=1", "self, *both", "self, request"])
def test_a_handler_need_not_be_annotated(arguments):
    names = {}
    exec(f"def on_reset({arguments}): ...", names)  # noqa: S102  # a signature as text
    handler = service(Trigger, "reset")(names["on_reset"])
    handler.check_service(Trigger)


@pytest.mark.parametrize("given", ["~/reset", Trigger.Request, Int64, None, Trigger()])
def test_a_wrong_service_type_is_refused_where_written(given, golden):
    with golden.raises(InvalidDeclaration):
        service(given, "reset")
    with golden.raises(InvalidDeclaration):
        client(given, "reset")


@pytest.mark.parametrize("depth", [0, -1, True, 1.5, "10"])
def test_a_depth_that_cannot_be_is_refused(depth, golden):
    class Answering(Node):
        @service(Trigger, "reset", depth=depth)
        def on_reset(self, request: Trigger.Request) -> Trigger.Response: ...

    with golden.raises(InvalidDeclaration):
        harnessed(Answering)


def harnessed(node_class):
    from busflow.clock import SystemClock
    from busflow.log import Log
    from busflow.node.context import Surroundings
    from busflow.node.node import runtime_of  # the way of a pre-flight check, without its report

    clock = SystemClock()
    runtime_of(node_class()).declare(Surroundings(clock, Log(clock)))


def test_a_timer_answers_no_service(golden):
    with golden.raises(InvalidDeclaration):
        service(Trigger, "reset")(timer(1.0)(lambda _: None))


def test_a_service_without_type_or_name_is_explained(golden):
    with golden.raises(InvalidDeclaration):
        service("~/reset")
    with golden.raises(InvalidDeclaration):
        service(Trigger)


@pytest.mark.parametrize("decorator", [subscription, on_event, service])
def test_decorator_without_its_arguments_is_explained(decorator, golden):
    def on(self, message): ...

    with golden.raises(InvalidDeclaration):
        decorator(on)


def test_a_swapped_subscription_is_put_right(golden):
    with golden.raises(InvalidDeclaration):
        subscription("numbers", Int64)


def test_unknown_keyword_of_a_subscription_is_refused():
    with pytest.raises(TypeError, match="'frame'"):
        subscription("points", frame="map")


def test_keyword_of_a_feature_is_checked_by_the_feature(golden):
    assert isinstance(subscription(Int64, "numbers", in_frame=None), PullDeclaration)
    with golden.raises(InvalidDeclaration):
        subscription(Int64, "numbers", in_frame="map")
