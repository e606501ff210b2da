"""What a class declares: known without running it, kept through inheritance, and wrong at the earliest moment."""

from __future__ import annotations

import asyncio
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING

import pytest

from busflow import Graph, Message, Node, Parameters, QoS, publisher, subscription, timer
from busflow.bus.events import DeadlineMissed
from busflow.clock import SimClock
from busflow.errors import InvalidDeclaration
from busflow.msgs.std_msgs import Bool, Int64, String
from busflow.node.declarations import ComposedDeclaration, PublisherDeclaration, PullDeclaration, TimerDeclaration
from busflow.node.handlers import Handler, declarations_of, on_event
from busflow.node.node import runtime_of
from busflow.testing import virtual_time

if TYPE_CHECKING:
    from busflow.msgs.std_msgs import Float64


class Camera(Parameters):
    hz: float = 4


class Rates(Parameters):
    rate_hz: float = 10
    period_s: float = 0.5
    name_of_it: str = "fast"
    on: bool = True
    camera: Camera = Camera()


def nothing(_self):
    """A method to be called now and then."""


class Base(Node):
    numbers = publisher(Int64, "numbers", qos=QoS(depth=3))
    words = subscription(String, "words")

    @subscription("numbers", qos=QoS(depth=7))
    def on_number(self, number: Int64) -> None:
        """Take a number."""

    @timer(0.5)
    def tick(self) -> None:
        """Tick."""


def kinds(node_class):
    return {name: type(each) for name, each in declarations_of(node_class).items()}


def test_a_class_shows_declarations_without_an_instance():
    found = declarations_of(Base)
    assert list(found) == ["numbers", "words", "on_number", "tick"]
    assert kinds(Base) == {
        "numbers": PublisherDeclaration,
        "words": PullDeclaration,
        "on_number": Handler,
        "tick": TimerDeclaration,
    }
    assert (Base.numbers.type, Base.numbers.topic, Base.numbers.qos) == (Int64, "numbers", QoS(depth=3))
    assert (Base.words.type, Base.words.topic, Base.words.qos) == (String, "words", None)
    assert Base.on_number.message_type() is Int64
    assert [(role.topic, role.qos) for role in Base.on_number.roles] == [("numbers", QoS(depth=7))]
    assert [each.origin for each in found.values()] == ["Base.numbers", "Base.words", "Base.on_number", "Base.tick"]


def test_an_endpoint_outside_a_graph_is_an_error(golden):
    node = Base()
    for name in ("numbers", "words", "tick"):
        with golden.raises(AttributeError):
            getattr(node, name)


def test_on_an_instance_a_handler_is_the_method():
    class Echo(Node):
        @subscription("numbers")
        def on_number(self, number: Int64) -> None:
            self.last = number.data

    echo = Echo()
    echo.on_number(Int64(data=4))
    assert echo.last == 4


def test_stacked_decorators_are_subscriptions_of_their_own():
    class Both(Node):
        @subscription("left", qos=QoS(depth=1))
        @subscription("right")
        def on_number(self, number: Int64) -> None: ...

    assert [(role.topic, role.qos) for role in Both.on_number.roles] == [("left", QoS(depth=1)), ("right", None)]


# Inheritance.


def test_an_override_without_a_decorator_keeps_the_declaration():
    class Derived(Base):
        def on_number(self, number: Int64) -> None:
            self.last = number.data

        def tick(self) -> None:
            self.ticked = True

    assert kinds(Derived) == kinds(Base)
    assert Derived.on_number.roles == Base.on_number.roles
    assert Derived.on_number.function is not Base.on_number.function
    assert Derived.tick.period(Rates()) == Fraction(1, 2)
    assert Derived.tick.origin == "Derived.tick"
    derived = Derived()
    derived.on_number(Int64(data=1))
    Derived.tick.function(derived)
    assert (derived.last, derived.ticked) == (1, True)


def test_an_override_may_omit_the_annotation():
    class Derived(Base):
        def on_number(self, number): ...

    class Grandchild(Derived):
        def on_number(self, number): ...

    assert Grandchild.on_number.message_type() is Int64


def test_an_override_may_state_another_local_type():
    class Special(Message, package="test"):
        data: int

    class Derived(Base):
        def on_number(self, number: Special) -> None: ...

    assert Derived.on_number.message_type() is Special
    assert Base.on_number.message_type() is Int64


def test_a_handler_of_events_can_be_overridden_too():
    class Watching(Base):
        @on_event("numbers")
        def on_silence(self, event: DeadlineMissed) -> None: ...

    class Derived(Watching):
        def on_silence(self, event): ...

    assert Derived.on_silence.event_type() is DeadlineMissed
    assert Derived.on_silence.function is not Watching.on_silence.function


def test_an_override_with_a_decorator_replaces_the_declaration():
    class Derived(Base):
        @subscription("others")
        def on_number(self, number: Int64) -> None: ...

        @timer(hz=8)
        def tick(self) -> None: ...

    assert [role.topic for role in Derived.on_number.roles] == ["others"]
    assert Derived.tick.period(Rates()) == Fraction(1, 8)


def test_none_removes_a_declaration_and_it_stays_removed():
    class Derived(Base):
        numbers = None
        on_number = None

    class Grandchild(Derived):
        def on_number(self, number: Int64) -> None: ...

    assert list(declarations_of(Derived)) == list(declarations_of(Grandchild)) == ["words", "tick"]


def test_a_mixin_declares_and_overrides_like_a_base():
    class Declaring:
        flags = publisher(Bool, "flags")

        @subscription("flags")
        def on_flag(self, flag: Bool) -> None: ...

    class Overriding:
        def on_number(self, number: Int64) -> None: ...

        def tick(self) -> None: ...

    class Mixed(Declaring, Overriding, Base):
        pass

    assert kinds(Mixed) == {**kinds(Base), "flags": PublisherDeclaration, "on_flag": Handler}
    assert Mixed.on_number.function is Overriding.on_number
    assert Mixed.on_number.roles == Base.on_number.roles
    assert Mixed.tick.function is Overriding.tick


# Annotations.


def test_an_annotation_of_the_surrounding_function_is_resolved():
    class Local(Message, package="test"):
        data: int

    class Taking(Node):
        @subscription("local")
        def on_local(self, local: Local) -> None: ...

    assert Taking.on_local.message_type() is Local


def test_only_the_message_s_annotation_is_resolved():
    class Loose(Node):
        @subscription("numbers")
        def on_number(self, number: Int64, more: Unheard = None) -> Unthought: ...  # noqa: F821  # that is the test

    assert Loose.on_number.message_type() is Int64


def test_a_type_checking_import_is_refused_with_remedy():
    class Checked(Node):
        @subscription("numbers")
        def on_number(self, number: Float64) -> None: ...

    with pytest.raises(InvalidDeclaration) as caught:
        Checked.on_number.message_type()
    for word in ("Checked.on_number", "'Float64' is not defined when the program runs", "TYPE_CHECKING"):
        assert word in str(caught.value)


def test_handler_without_annotation_is_refused_with_advice(golden):
    class Silent(Node):
        @subscription("numbers")
        def on_number(self, number): ...

        @on_event("numbers")
        def on_silence(self, event): ...

    with golden.raises(InvalidDeclaration):
        Silent.on_number.message_type()
    with golden.raises(InvalidDeclaration):
        Silent.on_silence.event_type()


@pytest.mark.parametrize("annotation", ["int", "Int64 | None", "list[Int64]", "'Int64'.nothing", "1 +", "Node"])
def test_an_annotation_that_is_no_message_is_refused(annotation):
    def on_number(self, number): ...

    on_number.__annotations__["number"] = annotation
    handler = subscription("numbers")(on_number)
    handler.__set_name__(Base, "on_number")
    with pytest.raises(InvalidDeclaration, match=r"Base\.on_number"):
        handler.message_type()


def test_an_annotation_without_event_names_the_kinds(golden):
    class Confused(Node):
        @on_event("numbers")
        def on_silence(self, event: Int64) -> None: ...

    with golden.raises(InvalidDeclaration, mask={", Unpaired": ""}):  # which other tests may have imported
        Confused.on_silence.event_type()


# Timers.


@pytest.mark.parametrize(
    ("declared", "period"),
    [
        (timer(0.1), Fraction(1, 10)),
        (timer(hz=3), Fraction(1, 3)),
        (timer("period_s"), Fraction(1, 2)),
        (timer(hz="rate_hz"), Fraction(1, 10)),
        (timer(hz="camera.hz"), Fraction(1, 4)),
    ],
    ids=["0.1 s", "3 Hz", "period_s", "rate_hz", "camera.hz"],
)
def test_a_timer_period_is_exact_or_a_parameter(declared, period):
    assert declared(nothing).period(Rates()) == period


def test_a_timer_says_which_parameter_decides():
    assert timer(hz="camera.hz")(nothing).parameter == "camera.hz"
    assert timer("period_s")(nothing).parameter == "period_s"
    assert timer(hz=3)(nothing).parameter is None


@pytest.mark.parametrize("name", ["nothing", "camera.nothing", "name_of_it", "on", "camera"])
def test_a_timer_that_names_no_number_says_so(name, golden):
    declared = timer(hz=name)(nothing)
    declared.__set_name__(Base, "tick")
    with golden.raises(InvalidDeclaration):
        declared.period(Rates())


@pytest.mark.parametrize("rate", [float("nan"), float("inf")])
def test_a_timer_refuses_a_parameter_without_rate(rate):
    with pytest.raises(InvalidDeclaration, match=str(rate)):
        timer(hz="rate_hz")(nothing).period(Rates(rate_hz=rate))


# Mistakes in the writing.


@pytest.mark.parametrize("given", [0, -1, float("nan"), float("inf"), True, [1], print])
def test_an_impossible_period_is_refused_where_written(given):
    with pytest.raises(InvalidDeclaration, match="@timer"):
        timer(given)
    with pytest.raises(InvalidDeclaration, match="@timer"):
        timer(hz=given)


def test_a_timer_has_a_period_or_a_rate(golden):
    for arguments in ({}, {"period_s": 1, "hz": 1}):
        with golden.raises(InvalidDeclaration):
            timer(**arguments)


def test_an_unknown_policy_is_refused_with_the_known(golden):
    with golden.raises(InvalidDeclaration):
        timer(1, missed="catch up")


def test_a_wrong_message_type_is_refused_where_written(golden):
    for declare in (publisher, subscription):
        for wrong in (int, 3, None, Node):
            with pytest.raises(InvalidDeclaration, match="needs"):
                declare(wrong, "numbers")
    with golden.raises(InvalidDeclaration):
        subscription(Int64)


def test_a_decorator_takes_its_qos_by_name(golden):
    with golden.raises(InvalidDeclaration):
        subscription("numbers", QoS(depth=1))


def test_a_method_is_either_timer_or_handler(golden):
    def method(self, number: Int64) -> None: ...
    def tick(self) -> None: ...

    for twice in (
        lambda: timer(1)(subscription("numbers")(method)),
        lambda: subscription("numbers")(timer(1)(tick)),
        lambda: timer(1)(timer(2)(tick)),
        lambda: on_event("numbers")(timer(1)(tick)),
    ):
        with golden.raises(InvalidDeclaration):
            twice()


@virtual_time
async def test_an_overridden_timer_can_call_its_base():
    class Base(Node):
        ticks = 0

        @timer(0.1)
        def tick(self) -> None:
            self.ticks += 1

    class Derived(Base):
        def tick(self) -> None:
            super().tick()
            self.ticks += 10

    graph = Graph([Derived], clock=SimClock())
    async with graph:
        await asyncio.sleep(0.15)
    assert graph.node(Derived).ticks == 11


def test_subscription_without_handler_is_no_decorator(golden):
    with golden.raises(InvalidDeclaration):

        @subscription(Int64, "numbers")
        def on_it(self, message): ...


def test_timer_calls_its_method_with_the_node_alone(golden):
    with golden.raises(InvalidDeclaration):

        @timer(1)
        def tick(self, number): ...


def test_topic_name_is_text(golden):
    with golden.raises(InvalidDeclaration):
        publisher(Int64, 3)


def test_callable_without_signature_may_be_handler():
    assert isinstance(timer(1)(partial(nothing)), TimerDeclaration)
    assert isinstance(subscription("numbers")(partial(nothing)), Handler)


@pytest.mark.parametrize(
    ("decorator", "example"), [(subscription("numbers"), "message: Imu"), (on_event("numbers"), "event: ")]
)
def test_handler_takes_one_thing_besides_the_node(decorator, example, golden):
    def method(self): ...
    def greedy(self, one, two): ...
    def collecting(self, *all_of_it): ...

    for wrong in (method, greedy):
        with golden.raises(InvalidDeclaration) as caught:
            decorator(wrong)
        assert f"write def {wrong.__name__}(self, {example}" in str(caught.value)
    assert isinstance(decorator(collecting), Handler)


class Pair(ComposedDeclaration[tuple[str, str]]):
    """Two publishers of numbers that stand as their topics' names on an instance."""

    def compose(self, node: Node) -> tuple[str, str]:
        runtime = runtime_of(node)
        ends = [runtime.create_publisher(Int64, f"{self.name}/{side}", None, origin=self.origin) for side in "ab"]
        runtime.on_connect.append(lambda bus: bus.shared.setdefault(node.name, sorted(bus.topics)))
        return ends[0].topic, ends[1].topic


class WithPair(Node):
    both = Pair()


@virtual_time
async def test_composed_declaration_creates_endpoints_and_is_connected():
    class Derived(WithPair):
        def both(self):
            """Override it with a method, which ends the declaration."""

    async with Graph([WithPair, Derived], clock=SimClock()) as graph:
        assert graph.node("with_pair").both == ("/both/a", "/both/b")
        assert {"/both/a", "/both/b"} <= set(graph.bus.shared["with_pair"])
        assert declarations_of(Derived) == {}


def test_composition_belongs_to_the_package_above():
    with pytest.raises(NotImplementedError):
        ComposedDeclaration[int]().compose(Base())
