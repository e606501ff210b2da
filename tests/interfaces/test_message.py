"""Messages as values: they cannot change, compare by value, travel whole; and how their types are named and found."""

import copy
import json
import math
import pickle
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Annotated, ClassVar

import numpy as np
import pytest
from pydantic import ConfigDict, Field, PrivateAttr, ValidationError, field_validator
from pydantic.version import version_short

from busflow.clock import Duration as ClockDuration
from busflow.clock import Time as ClockTime
from busflow.errors import InvalidDeclaration, InvalidMessage, UnknownType
from busflow.interfaces.message import (
    Constant,
    Float64Array,
    Length,
    Message,
    ServiceType,
    UInt8Array,
    constants_of,
    fields_of,
    find_type,
    float64,
    int8,
    is_ros_type,
    string,
    take,
    type_name,
    uint8,
    zeros,
)
from busflow.msgs.builtin_interfaces import Duration, Time
from busflow.msgs.geometry_msgs import Point, Vector3
from busflow.msgs.sensor_msgs import Image, Imu, JointState
from busflow.msgs.std_msgs import Empty, Header
from busflow.msgs.std_srvs import Trigger
from busflow.msgs.trajectory_msgs import JointTrajectoryPoint
from tests.new_interpreter import printed_by


class Sample(Message, package="tests"):
    """One field of each kind."""

    number: float64 = 0.0
    gains: Annotated[Float64Array, Length(3)] = zeros(3)
    data: UInt8Array = zeros()
    names: Sequence[str] = ()
    points: Sequence[Vector3] = ()
    stamp: Time = Time()


class Tree(Message, package="tests"):
    """What ROS cannot describe: it may hold itself."""

    arrays: dict[str, Float64Array] = Field(default_factory=dict)
    left: "Tree | None" = None


# Values


def test_a_message_cannot_change(golden):
    message = Sample(gains=[1, 2, 3])
    for change in (lambda: setattr(message, "number", 1.0), lambda: delattr(message, "number")):
        with golden.raises(InvalidMessage):
            change()
    with pytest.raises(InvalidMessage):
        message.other = 1
    with pytest.raises(ValueError, match="read-only"):
        message.gains[0] = 1
    with pytest.raises(ValueError, match="WRITEABLE"):
        message.gains.setflags(write=True)


def test_replace_makes_a_checked_message():
    first = Sample(number=1, names=["a"])
    second = first.replace(number=2)
    assert (first.number, second.number, second.names) == (1.0, 2.0, ("a",))
    for wrong in ({"number": "2"}, {"numbre": 2}, {"gains": [1]}):
        with pytest.raises(InvalidMessage):
            first.replace(**wrong)


def test_pydantic_s_own_copying_checks_too():
    first = Sample(number=1)
    assert first.model_copy() == first
    assert first.model_copy(update={"number": 2}) == Sample(number=2)
    assert first.number == 1.0
    with pytest.raises(InvalidMessage):
        first.model_copy(update={"number": "2"})
    if sys.version_info >= (3, 13):
        with pytest.raises(InvalidMessage):
            copy.replace(first, number="2")


def test_equality_compares_values():
    assert Sample(gains=[1, 2, 3], data=b"ab") == Sample(gains=np.array([1, 2, 3]), data=[97, 98])
    assert Sample(gains=[1, 2, 3]) != Sample(gains=[1, 2, 4])
    assert Sample(data=b"a") != Sample(data=b"ab")
    assert Sample(points=[Vector3(x=1)]) != Sample(points=[Vector3(x=2)])
    assert Sample(names=["a"]) != Sample(names=["a", "b"])
    assert Point() != Vector3(), "their fields have the same names"
    assert Sample() != 1


def test_nan_equals_nan_and_zero_its_negative():
    assert Sample(number=math.nan) == Sample(number=float("nan"))
    assert Sample(gains=[math.nan, 0.0, 1]) == Sample(gains=[math.nan, -0.0, 1])
    assert Sample(points=[Vector3(x=math.nan)]) == Sample(points=[Vector3(x=math.nan)])
    assert Sample(number=0.0) == Sample(number=-0.0)
    assert Sample(number=math.nan) != Sample(number=1.0)


def test_an_unhashable_message_says_what_to_do(golden):
    for use in (hash, lambda message: {message}, lambda message: {message: 1}):
        with pytest.raises(TypeError):
            use(Vector3())
    with golden.raises(TypeError):
        hash(Vector3())


@pytest.mark.parametrize(
    "duplicate",
    [copy.copy, copy.deepcopy, lambda message: pickle.loads(pickle.dumps(message))],  # noqa: S301 - made here
    ids=["copy", "deepcopy", "pickle"],
)
@pytest.mark.parametrize(
    "message",
    [
        Sample(gains=[1, 2, 3], data=b"abc", points=[Vector3(x=1)]),
        Image(data=take(np.arange(12, dtype=np.uint8).reshape(2, 6))),
        Tree(arrays={"a": [1, 2]}, left=Tree(arrays={"b": [3]})),
    ],
    ids=lambda message: type(message).__name__,
)
def test_copies_are_equal_and_as_unchangeable(message, duplicate):
    made = duplicate(message)
    assert made == message
    assert type(made) is type(message)
    arrays = [each for each in made.__dict__.values() if isinstance(each, np.ndarray)]
    arrays += list(made.arrays.values()) if isinstance(made, Tree) else []
    assert arrays
    for each in arrays:
        with pytest.raises(ValueError, match="WRITEABLE"):
            each.setflags(write=True)


def test_a_deep_copy_shares_nothing_that_can_change():
    tree = Tree(arrays={"a": [1, 2]})
    copied = copy.deepcopy(tree)
    copied.arrays["b"] = tree.arrays["a"]
    assert "b" not in tree.arrays


def test_what_comes_out_of_a_pickle_is_checked():
    restore, (cls, values) = Vector3(x=1.0).__reduce__()
    with pytest.raises(InvalidMessage):
        restore(cls, values | {"x": "one"})


def test_a_message_prints_its_class_and_large_arrays_short(golden):
    assert str(Vector3(x=1.0)) == repr(Vector3(x=1.0)) == f"{Vector3(x=1.0)}"
    names = [f"joint{i}" for i in range(1000)]
    many = [Vector3(x=1.0), Image(data=np.zeros(921600, np.uint8)), Sample(gains=[1, 2, 3]), JointState(name=names)]
    golden("\n".join(map(repr, many)))


def test_json_holds_nan_and_infinity():
    message = Sample(number=math.nan, gains=[math.inf, -math.inf, math.nan])
    text = message.model_dump_json()
    assert json.loads(text)["gains"][0] == math.inf
    assert Sample.model_validate_json(text) == message


def test_json_is_as_strict_as_python():
    for wrong in ('{"number": "1"}', '{"number": true}', '{"gains": [1, 2]}', '{"names": "ab"}', '{"data": [256]}'):
        with pytest.raises(ValidationError):
            Sample.model_validate_json(wrong)


def test_a_dump_keeps_arrays_as_arrays():
    dumped = Sample(gains=[1, 2, 3]).model_dump()
    assert isinstance(dumped["gains"], np.ndarray)
    assert dumped["stamp"] == {"sec": 0, "nanosec": 0}


@pytest.mark.parametrize("message", [Vector3(x=1.0), Vector3.model_validate({"x": 1.0, "y": 0.0, "z": 0.0})])
def test_pydantic_reads_the_schema_of_a_message(message):
    assert message.model_fields_set == {"x", "y", "z"}
    assert message.model_extra is None
    assert message.model_dump(exclude_unset=True) == dict(message) == {"x": 1.0, "y": 0.0, "z": 0.0}


def test_a_missing_field_is_an_attribute_error():
    with pytest.raises(AttributeError, match="'Vector3' object has no attribute 'w'"):
        _ = Vector3().w


# Time stamps


def test_a_clock_s_time_becomes_a_stamp():
    header = Header(stamp=ClockTime(1_500_000_001), frame_id="imu_link")
    assert header.stamp == Time(sec=1, nanosec=500_000_001)
    assert type(header.stamp) is Time
    assert JointTrajectoryPoint(time_from_start=ClockDuration(-1)).time_from_start == Duration(
        sec=-1, nanosec=999_999_999
    )


@pytest.mark.parametrize("wrong", [ClockDuration(1), Duration(sec=1), 1.5, 1, None, "now", {"sec": 2**31}], ids=repr)
def test_what_is_not_a_time_is_refused(wrong):
    with pytest.raises(InvalidMessage):
        Header(stamp=wrong)


# Declarations


@pytest.mark.parametrize(
    "name", ["Rate", "rate_Hz", "rate__hz", "rate_", "räte", "copy", "json", "replace", "model_dump"]
)
def test_a_field_name_that_ros_or_a_method_forbids_is_refused(name):
    with pytest.raises(InvalidDeclaration, match=name):
        type("Sample", (Message,), {"__annotations__": {name: float64}, "__module__": __name__})


MISTAKES = {
    "field name": "class Sample(Message): rate__hz: float64 = 0.0",
    "hidden method": "class Sample(Message): model_fields: float64 = 0.0",
    "type name": "class balance(Message): pass",
    "type name with _": "class My_Balance(Message): pass",
    "type name in German": "class Größe(Message): pass",
    "package": "class Sample(Message, package='My-robot'): pass",
    "empty package": "class Sample(Message, package=''): pass",
    "annotation": "class Sample(Message): value: 'Missing'",
    "constructor": "class Sample(Message):\n    def __init__(self, **data): super().__init__(**data)",
    "not frozen": "class Sample(Message): model_config = {'frozen': False}",
    "extra allowed": "class Sample(Message): model_config = {'extra': 'allow'}",
    "extra ignored": "class Sample(Message): model_config = {'extra': 'ignore'}",
    "no response": "class Reset(ServiceType):\n    class Request(Message): pass",
    "no request": "class Reset(ServiceType): Request = int",
    "constant out of range": "class Level(Message): BAD: ClassVar[uint8] = 256",
    "constant without value": "class Level(Message): BAD: ClassVar[uint8]",
    "constant in lower case": "class Level(Message): ok: ClassVar[uint8] = 0",
    "constant of unknown type": "class Level(Message): OK: 'ClassVar[uint9]' = 0",
    "name of no message": "type_name(Message)",
    "name of no service": "type_name(ServiceType)",
    "name of a number": "type_name(int)",
}


NAMES = {each.__name__: each for each in (Message, ServiceType, type_name)}
NAMES |= {"ClassVar": ClassVar, "uint8": uint8, "float64": float64}


@pytest.mark.parametrize("case", MISTAKES)
def test_wrong_declaration_is_refused(golden, case):
    with golden.raises(InvalidDeclaration):
        exec(MISTAKES[case], {**NAMES, "__name__": __name__})  # noqa: S102  # a declaration as text


def test_validators_of_pydantic_work():
    class Positive(Message, package="tests"):
        value: float64 = 0.0

        @field_validator("value")
        @classmethod
        def not_negative(cls, value):
            if value < 0:
                raise ValueError("negative")
            return value

    assert Positive(value=np.float32(1)).value == 1.0
    for wrong in (-1, "1"):
        with pytest.raises(InvalidMessage):
            Positive(value=wrong)


def test_a_subclass_inherits_fields_and_has_its_name():
    class Labelled(Imu, package="tests"):
        label: str = ""

    message = Labelled(label="a", orientation_covariance=np.eye(3))
    assert type_name(Labelled) == "tests/msg/Labelled"
    assert [field.name for field in fields_of(Labelled)] == [*(field.name for field in fields_of(Imu)), "label"]
    assert message.replace(label="b").label == "b"
    with pytest.raises(InvalidMessage):
        Imu(label="a")


# Names


def test_a_type_is_named_for_its_package():
    assert type_name(Imu) == "sensor_msgs/msg/Imu"
    assert type_name(Trigger) == "std_srvs/srv/Trigger"
    assert type_name(Trigger.Request) == "std_srvs/srv/Trigger_Request"


@pytest.mark.parametrize("package", ["my-robot", "my__robot", "robot_", "1robot", "röbot"])
def test_a_package_outside_ros_s_grammar_is_refused(package):
    with pytest.raises(InvalidDeclaration):
        type("Sample", (Message,), {}, package=package)


def run_file(tmp_path, path, text, *arguments, folder="."):
    """What a Python file prints that is run as a script."""
    file = tmp_path / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, *(arguments or [str(file)])], capture_output=True, text=True, cwd=tmp_path / folder
    )
    return done.stdout.strip() or done.stderr.strip().splitlines()[-1]


PRINTS_ITS_TYPE = """
from busflow.interfaces.message import Message, type_name
class Sample(Message):
    pass
print(type_name(Sample))
"""


@pytest.mark.parametrize(
    ("path", "arguments", "package"),
    [
        ("My-Robot.2.py", (), "my_robot_2"),
        ("robot/__main__.py", ("robot",), "robot"),
        ("robot/nodes/talker.py", ("-m", "robot.nodes.talker"), "robot"),
        ("unused.py", ("-c", PRINTS_ITS_TYPE), "main"),
    ],
)
def test_a_script_s_types_belong_to_the_script(tmp_path, path, arguments, package):
    assert run_file(tmp_path, path, PRINTS_ITS_TYPE, *arguments) == f"{package}/msg/Sample"


def test_script_name_without_package_is_refused_with_advice(tmp_path):
    assert 'package="my_robot"' in run_file(tmp_path, "2024.py", PRINTS_ITS_TYPE)


def test_an_installed_type_belongs_to_the_top_package(tmp_path, monkeypatch):
    (tmp_path / "my_robot/nodes").mkdir(parents=True)
    (tmp_path / "my_robot/nodes/types.py").write_text(PRINTS_ITS_TYPE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    assert type_name(import_module("my_robot.nodes.types").Sample) == "my_robot/msg/Sample"


def test_a_plugins_type_has_the_outer_folders_name(tmp_path):
    """A plugin folder stands in sys.modules under a unique name whose path it is."""
    code = (
        "import sys, types, importlib; package = types.ModuleType('plugins_1f2e'); package.__path__ = [sys.argv[1]];"
        "sys.modules['plugins_1f2e'] = package; importlib.import_module('plugins_1f2e.talker')"
    )
    folder = tmp_path / "Walking Robot/plugins"
    folder.mkdir(parents=True)
    (folder / "talker.py").write_text(PRINTS_ITS_TYPE, encoding="utf-8")
    assert printed_by(code, str(folder)) == "walking_robot/msg/Sample"


# Services, constants, finding


def test_constants_are_class_variables_of_a_ros_type():
    class Level(Message, package="tests"):
        OK: ClassVar[uint8] = 0
        WORST: ClassVar[int8] = -128
        UNIT: ClassVar[string] = "m"
        helper: ClassVar[int] = 3
        COUNT: ClassVar[int] = 3
        level: uint8 = 0
        LIMIT: ClassVar[uint8] = 9
        limit: uint8 = 0

    assert constants_of(Level) == (
        Constant("OK", "uint8", 0, 0),
        Constant("WORST", "int8", -128, 0),
        Constant("UNIT", "string", "m", 0),
        Constant("LIMIT", "uint8", 9, 1),
    )
    assert Level.WORST == -128
    assert [field.name for field in fields_of(Level)] == ["level", "limit"]


def test_a_ros_type_has_only_ros_types_inside():
    class Outer(Message, package="tests"):
        tree: Tree = Tree()

    assert is_ros_type(Sample)
    assert is_ros_type(Empty)
    assert not is_ros_type(Tree)
    assert not is_ros_type(Outer)


def test_type_is_found_beside_another_of_its_name():
    assert type_name(find_type("control_msgs/msg/GripperCommand")) == "control_msgs/msg/GripperCommand"
    assert type_name(find_type("control_msgs/action/GripperCommand")) == "control_msgs/action/GripperCommand"


@pytest.mark.parametrize("name", ["x" * 1_000_000, "std_msgs/msg/" + "\x1b[31m" * 100_000])
def test_an_unknown_type_of_a_megabyte_is_cut(name):
    with pytest.raises(UnknownType) as caught:
        find_type(name)
    assert len(str(caught.value)) < 1_000
    assert "\x1b" not in str(caught.value)


UNKNOWN = "sensor_msgs/msg/Imuu sensor_msgs/Joint_State sensor_msg/msg/Imu std_srvs/msg/Trigger Imu sensor_msgs"


@pytest.mark.parametrize("name", ["", "sensor_msgs/msg/Imu/", "std_msgs/msg/__all__", "../msg/Imu", *UNKNOWN.split()])
def test_an_unknown_type_suggests_the_nearest_one(golden, name):
    with golden.raises(UnknownType):
        find_type(name)


@pytest.mark.skipif(tuple(map(int, version_short().split("."))) < (2, 14), reason="pydantic refuses it first")
@pytest.mark.parametrize("value", [0.0, True, None, Field(default=1.0)], ids=["number", "flag", "none", "field"])
def test_value_without_annotation_is_refused_with_advice(golden, value):
    with golden.raises(InvalidDeclaration):
        type("Sample", (Message,), {"x": value, "__module__": __name__}, package="tests")


def test_what_is_no_field_needs_no_annotation():
    class Known(Message, package="tests"):
        LIMIT: ClassVar[float] = 1.0
        value: float = 0.0

        @property
        def double(self) -> float:
            return 2 * self.value

        @staticmethod
        def of(value: float) -> "Known":
            return Known(value=value)

    class Narrow(Known, package="tests"):
        LIMIT = 0.5

    assert (Narrow.LIMIT, Known.of(2.0).double) == (0.5, 4.0)


def packaged(module_name):
    """The name of a type that a module of this name declares."""
    space = {"__name__": module_name, "Message": Message}
    exec("class Own(Message): ...", space)  # noqa: S102  # a module as text
    return type_name(space["Own"])


@pytest.mark.parametrize(
    ("file", "spec", "package"),
    [
        ("/lab/drive.py", None, "drive"),
        ("/lab/robot/__main__.py", "__main__", "robot"),
        ("/lab/robot/drive.py", "robot.drive", "robot"),
        (None, None, "main"),
    ],
)
def test_main_module_is_named_for_script_or_package(monkeypatch, file, spec, package):
    main = ModuleType("__main__")
    main.__file__, main.__spec__ = file, spec and ModuleSpec(spec, None)
    monkeypatch.setitem(sys.modules, "__main__", main)
    assert packaged("__main__") == f"{package}/msg/Own"


def test_single_module_is_a_package_of_its_name(monkeypatch):
    monkeypatch.setitem(sys.modules, "lone_module", ModuleType("lone_module"))
    assert packaged("lone_module") == "lone_module/msg/Own"


def test_private_attribute_is_no_field():
    class Noted(Message, package="test"):
        number: int8 = 0
        _note: str = PrivateAttr(default="")

    message = Noted(number=1)
    message._note = "seen"
    assert message == Noted(number=1)
    assert message._note == "seen"


def test_class_built_at_once_is_no_other():
    class Eager(Message, package="made_here"):
        model_config = ConfigDict(defer_build=False)
        level: float = 0.5

    assert (Eager().level, Eager(level=2).level, Eager.model_validate_json('{"level": 1}')) == (
        0.5,
        2.0,
        Eager(level=1),
    )
