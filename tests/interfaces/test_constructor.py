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
from busflow.errors import BusflowError, InvalidMessage
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
    (),
    ["a"],
    ("a", "é"),
    ["a", "b", "c"],
    ["\ud800"],
    ["a", 1],
    "ab",
    {"a"},
    [Vector3(x=1)],
    [Labelled()],
    [{}],
]
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


def test_positional_values_are_refused_with_their_field_names():
    class Pair(Message, package="tests"):
        left: float64 = 0.0
        right: float64 = 0.0

    for _ in range(2):
        with pytest.raises(TypeError, match=r"^Pair takes its fields by name: write Pair\(left=1.0, right=2.0\)$"):
            Pair(1.0, 2.0)  # type: ignore[call-arg]  # the mistake that is meant
        Pair(left=1.0)


def test_a_field_without_a_default_is_required():
    class Required(Message, package="tests"):
        value: float64
        names: Sequence[str]
        place: Vector3

    assert Required(value=1, names=["a"], place=Vector3()).value == 1.0
    with pytest.raises(InvalidMessage, match=r"Required: the field names is required \(write names=…\)"):
        Required(value=1, place=Vector3())


def test_each_field_checks_a_known_text_itself():
    class Texts(Message, package="tests"):
        any_number: Sequence[str] = ()
        two: Annotated[Sequence[str], Length(2)] = ("a", "b")

    one = ("a",)
    assert Texts(any_number=one).any_number is Texts(any_number=one).any_number is one
    for _ in range(2):
        with pytest.raises(InvalidMessage, match="two"):
            Texts(any_number=one, two=one)


def test_a_subclass_has_a_constructor_of_its_own():
    class Parent(Message, package="tests"):
        value: float64 = 1.0

    class Child(Parent, package="tests"):
        more: float64 = 2.0

    for cls in (Parent, Child, Parent):
        assert type(cls()) is cls
    assert (Child(more=3.0).more, Child().value) == (3.0, 1.0)
    with pytest.raises(InvalidMessage, match="unknown field more"):
        Parent(more=1.0)


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
    assert [type(each) for each in (box.header, box.header.stamp, box.share, box.nothing)] == [
        Header,
        Time,
        Share,
        Nothing,
    ]
    assert given == {"header": {"stamp": {"sec": 1}, "frame_id": "a"}, "share": {"value": 1}, "nothing": {}}
    with pytest.raises(InvalidMessage, match=r"Box: share\.value must be less than or equal to 1, got 2"):
        Box(share={"value": 2})
    with pytest.raises(InvalidMessage, match=r"Box: header\.frame_id must be a valid string, got 5"):
        Box(header={"frame_id": 5})


def test_a_dict_becomes_the_field_s_own_class():
    class Parent(Message, package="tests"):
        value: float64 = 1.0

    class Child(Parent, package="tests"):
        more: float64 = 2.0

    class Family(Message, package="tests"):
        parent: Parent = Parent()
        child: Child = Child()

    family = Family(parent={"value": 3.0}, child={"value": 4.0, "more": 5.0})
    assert family == Family(parent=Parent(value=3.0), child=Child(value=4.0, more=5.0))
    with pytest.raises(InvalidMessage, match=r"unknown field parent\.more"):
        Family(parent={"more": 1.0})


# What is wrong, in words


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Vector3(x="fast"), "Vector3: x must be float64, a number, got 'fast'"),
        (lambda: Vector3(z=True), "Vector3: z must be float64, a number, got True"),
        (lambda: Vector3(xx=1.0, y=2.0), "Vector3: unknown field xx (did you mean 'x'?)"),
        (lambda: Imu(angular_velocity={"x": None}), "Imu: angular_velocity.x must be float64, a number, got None"),
        (lambda: Imu(header={"frame": ""}), "Imu: unknown field header.frame (did you mean 'frame_id'?)"),
        (lambda: Everything(count=256), "Everything: count must be uint8, an integer from 0 to 255, got 256"),
        (lambda: Everything(gains=[1.0]), "Everything: gains: the array takes exactly 2 values, not 1"),
        (
            lambda: JointState(position="0.1"),
            "JointState: position: the array takes a numpy array, a list or a tuple, not str",
        ),
        (lambda: Header(stamp=1.5), "Header: stamp must be a builtin_interfaces/msg/Time or a clock's Time, got 1.5"),
        (lambda: Everything(narrow=1e39), "Everything: narrow: float32 cannot hold so large a number"),
        (lambda: Everything(short="long"), "Everything: short: string must have at most 3 characters"),
        (
            lambda: Vector3(x="a", why=1),
            "Vector3: x must be float64, a number, got 'a'; unknown field why (known: x, y, z)",
        ),
    ],
)
def test_mistake_is_worded_by_busflow(make, words):
    with pytest.raises(BusflowError) as caught:
        make()
    assert isinstance(caught.value, ValueError)
    assert str(caught.value) == words
    assert caught.value.__cause__ is None
    assert caught.value.__suppress_context__


def test_broken_constraint_is_reported_with_its_limit():
    assert Share(value=1).value == 1.0
    with pytest.raises(InvalidMessage, match=r"Share: value must be less than or equal to 1, got 1\.5"):
        Share(value=1.5)


def test_any_value_makes_a_short_error():
    with pytest.raises(InvalidMessage) as caught:
        Vector3(x="long" * 10_000)
    assert len(str(caught.value)) < 200


def test_assignment_is_refused_with_advice():
    message = Vector3()
    for change in (lambda: setattr(message, "x", 1.0), lambda: delattr(message, "x")):
        with pytest.raises(InvalidMessage, match=r"Vector3: x cannot change, a message is frozen \(make a new one: "):
            change()


def test_values_without_names_are_refused_beside_own_rules():
    class Ruled(Message, package="tests"):
        number: float64 = 0.0

        @model_validator(mode="after")
        def check(self):
            return self

    assert Ruled(number=2).number == 2
    with pytest.raises(TypeError, match=r"^Ruled takes its fields by name: write Ruled\(number=2\)$"):
        Ruled(2)  # type: ignore[call-arg]  # the mistake that is meant
