"""The constructor written for each class: it takes what pydantic takes, and says what is wrong in busflow's words."""

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, create_model, model_validator

from busflow.clock import Time as ClockTime
from busflow.errors import InvalidMessage
from busflow.interfaces.message import Float64Array, Length, Message, UInt8Array, float32, float64, uint8
from busflow.msgs.builtin_interfaces import Time
from busflow.msgs.geometry_msgs import Point, Vector3
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import Header


class Everything(Message, package="tests"):
    """One field of each kind that the constructor knows."""

    wide: float64 = 0.5
    narrow: float32 = 0.5
    count: uint8 = 7
    on: bool = False
    text: str = "a"
    short: Annotated[str, Length(max=3)] = ""
    data: UInt8Array = ()
    gains: Annotated[Float64Array, Length(2)] = (1.0, 2.0)
    names: Sequence[str] = ()
    few: Annotated[Sequence[str], Length(max=2)] = ()
    points: Sequence[Vector3] = ()
    place: Vector3 = Vector3(x=1.0)
    stamp: Time = Time()


class Labelled(Vector3, package="tests"):
    label: str = ""


NUMBERS = [0, 1, 255, 256, -1, 2**70, 0.1, 1e300, math.inf, True, None, "1", "", np.float32(0.1), np.uint8(3), np.True_]
TEXTS = ["", "a", "four", "é", "ééé", "\ud800", b"a", 1, None]
LISTS = [(), [], [1.0, 2.0], (1, 2), [1, "a"], [True], np.zeros(2), np.zeros(3, np.float32), b"ab", "ab", {1, 2}, 3]
SEQUENCES = [
    (), ["a"], ("a", "é"), ["a", "b", "c"], ["\ud800"], ["a", 1], "ab", {"a"}, [Vector3(x=1)], [Labelled()], [{}],
]  # fmt: skip
MESSAGES = [Vector3(y=2.0), Labelled(x=1.0), Point(), {"x": 3}, {"x": "3"}, None, 1, ClockTime(5), Time(sec=1)]
GIVEN = {
    **dict.fromkeys(["wide", "narrow", "count", "on"], NUMBERS),
    **dict.fromkeys(["text", "short"], TEXTS),
    **dict.fromkeys(["data", "gains"], LISTS),
    **dict.fromkeys(["names", "few", "points"], SEQUENCES),
    **dict.fromkeys(["place", "stamp"], MESSAGES),
    "unknown": [1],
}


def outcome(make):
    try:
        return make()
    except ValueError:
        return "refused"


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in GIVEN.items() for value in values])
def test_each_value_is_taken_as_pydantic_takes_it(name, value):
    made = outcome(lambda: Everything(**{name: value}))
    validated = outcome(lambda: Everything.model_validate({name: value}))
    assert made == validated
    if made != "refused":
        assert {key: type(each) for key, each in made} == {key: type(each) for key, each in validated}
        assert list(made.__dict__) == list(Everything.model_fields)
        assert Everything.model_validate_json(made.model_dump_json()) == Everything.model_validate(made.model_dump())


@given(st.fixed_dictionaries({}, optional={name: st.sampled_from(values) for name, values in GIVEN.items()}))
def test_several_values_are_taken_as_pydantic_takes_them(values):
    assert outcome(lambda: Everything(**values)) == outcome(lambda: Everything.model_validate(values))


@pytest.mark.parametrize("name", ["message", "self", "type", "unknown", "g1", "given1", "len", "x1"])
def test_a_field_may_have_any_name(name):
    cls = create_model("Sample", __base__=Message, **{name: (uint8, 1), "other": (str, "")})
    assert getattr(cls(**{name: 5}), name) == 5
    assert getattr(cls(**{name: np.uint8(5)}), name) == 5
    with pytest.raises(InvalidMessage, match=name):
        cls(**{name: 256})


class Required(Message, package="tests"):
    value: float64
    names: Sequence[str]
    place: Vector3


def test_a_field_without_a_default_is_required():
    assert Required(value=1, names=["a"], place=Vector3()).value == 1.0


def test_each_field_checks_a_known_text_itself():
    class Texts(Message, package="tests"):
        any_number: Sequence[str] = ()
        two: Annotated[Sequence[str], Length(2)] = ("a", "b")

    one = ("a",)
    assert Texts(any_number=one).any_number is Texts(any_number=one).any_number == one
    for _ in range(2):
        with pytest.raises(InvalidMessage, match="two"):
            Texts(any_number=one, two=one)


class Parent(Message, package="tests"):
    value: float64 = 1.0


class Child(Parent, package="tests"):
    more: float64 = 2.0


class Family(Message, package="tests"):
    parent: Parent = Parent()
    child: Child = Child()


def test_a_subclass_has_a_constructor_of_its_own():
    for cls in (Parent, Child, Parent):
        assert type(cls()) is cls
    assert (Child(more=3.0).more, Child().value) == (3.0, 1.0)
    family = Family(parent={"value": 3.0}, child={"value": 4.0, "more": 5.0})
    assert family == Family(parent=Parent(value=3.0), child=Child(value=4.0, more=5.0))
    for wrong in (lambda: Parent(more=1.0), lambda: Family(parent={"more": 1.0})):
        with pytest.raises(InvalidMessage, match="more"):
            wrong()


class Share(Message, package="tests"):
    """Has a rule beyond its type."""

    value: float64 = Field(default=0.0, ge=0, le=1)


class Nothing(Message, package="tests"):
    pass


class Box(Message, package="tests"):
    everything: Everything = Everything()
    share: Share = Share()
    nothing: Nothing = Nothing()
    header: Header = Header()


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in GIVEN.items() for value in values])
def test_a_nested_message_may_be_a_dict(name, value):
    boxed = outcome(lambda: Box(everything={name: value}).everything)
    assert boxed == outcome(lambda: Everything(**{name: value}))
    assert boxed == "refused" or type(boxed) is Everything


def test_dicts_are_messages_at_any_depth():
    given = {"header": {"stamp": {"sec": 1}, "frame_id": "a"}, "share": {"value": 1}, "nothing": {}}
    assert Box(**given) == Box(header=Header(stamp=Time(sec=1), frame_id="a"), share=Share(value=1.0))
    box = Box(**given)
    types = [type(each) for each in (box.header, box.header.stamp, box.share, box.nothing)]
    assert types == [Header, Time, Share, Nothing]
    assert given == {"header": {"stamp": {"sec": 1}, "frame_id": "a"}, "share": {"value": 1}, "nothing": {}}


# What is wrong, in words


MISTAKES = {
    "text": lambda: Vector3(x="fast"),
    "long text": lambda: Vector3(x="long" * 10_000),
    "flag": lambda: Vector3(z=True),
    "unknown field": lambda: Vector3(xx=1.0, y=2.0),
    "inner value": lambda: Imu(angular_velocity={"x": None}),
    "inner field": lambda: Imu(header={"frame": ""}),
    "inner text": lambda: Box(header={"frame_id": 5}),
    "too large": lambda: Everything(count=256),
    "too large for float32": lambda: Everything(narrow=1e39),
    "too few": lambda: Everything(gains=[1.0]),
    "text for an array": lambda: JointState(position="0.1"),
    "number for a time": lambda: Header(stamp=1.5),
    "too long": lambda: Everything(short="long"),
    "two mistakes": lambda: Vector3(x="a", why=1),
    "own rule": lambda: Share(value=1.5),
    "own rule inside": lambda: Box(share={"value": 2}),
    "missing": lambda: Required(value=1, place=Vector3()),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistake_is_worded_by_busflow(golden, mistake):
    with golden.raises(InvalidMessage) as caught:
        MISTAKES[mistake]()
    assert isinstance(caught.value, ValueError)
    assert caught.value.__cause__ is None
    assert caught.value.__suppress_context__


class Ruled(Message, package="tests"):
    number: float64 = 0.0

    @model_validator(mode="after")
    def check(self):
        return self


@pytest.mark.parametrize("cls", [Share, Ruled])
def test_values_without_names_are_refused_with_their_fields(golden, cls):
    for part in ("before the first message", "after it"):
        with golden.raises(TypeError, part):
            cls(1.0)
        assert cls(**{next(iter(cls.model_fields)): 1.0})
