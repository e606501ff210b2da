"""The standard messages are ROS 2's, field by field, and each survives being dumped, printed as JSON and pickled.

Tests of `action_msgs.py`, `builtin_interfaces.py`, `control_msgs.py`, `diagnostic_msgs.py`, `example_interfaces.py`,
`lifecycle_msgs.py`, `nav_msgs.py`, `rosgraph_msgs.py`, `service_msgs.py`, `shape_msgs.py`,
`std_srvs.py`, `stereo_msgs.py`, `tf2_msgs.py`, `trajectory_msgs.py`, `type_description_interfaces.py`,
`unique_identifier_msgs.py`, `vision_msgs.py` and `visualization_msgs.py`. A test runs for a package, over all
its types.
"""

import copy
import json
import pickle
import pkgutil
from importlib import import_module

import numpy as np
import pytest
from hypothesis import given, settings
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

import busflow.msgs
from busflow.interfaces.action import ActionType
from busflow.interfaces.encoding.description import rihs01
from busflow.interfaces.encoding.typesupport import TypeSupport, describe
from busflow.interfaces.fields import PRIMITIVES
from busflow.interfaces.message import (
    ArrayKind,
    Message,
    ServiceType,
    constants_of,
    fields_of,
    find_type,
    is_ros_type,
    type_name,
)
from busflow.runner.service_events import event_class
from tests.interfaces.any_message import by_group, messages
from tests.new_interpreter import printed_by
from tests.vectors import cases, suite

PACKAGES = sorted(module.name for module in pkgutil.iter_modules(busflow.msgs.__path__))
TYPES = [
    getattr(module, word)
    for module in (import_module(f"busflow.msgs.{package}") for package in PACKAGES)
    for word in module.__all__
]
INSIDE = [vars(each) for each in TYPES if each.__name__ == "action"]  # a class around types with others' names
TYPES += [value for inside in INSIDE for value in inside.values() if isinstance(value, type)]
MESSAGES = {type_name(each): each for each in TYPES if issubclass(each, Message)}
SERVICES = {type_name(each): each for each in TYPES if issubclass(each, ServiceType)}
ACTIONS = {type_name(each): each for each in TYPES if issubclass(each, ActionType)}
PARTS = {type_name(part): part for each in SERVICES.values() for part in (each.Request, each.Response)}
PARTS |= {type_name(part): part for each in ACTIONS.values() for part in (each.Goal, each.Result, each.Feedback)}
ALL = MESSAGES | PARTS

ROS = get_typestore(Stores.LATEST)
FILES = [suite("ros2_interfaces"), suite("ros2_generated_interfaces")]
CASES = {case["id"]: case for file in FILES for case in file["cases"] if case["id"].partition("/")[0] in PACKAGES}
HASHES = {name: case["rihs01"] for name, case in CASES.items() if "rihs01" in case} | {
    name: found for name, found in FILES[1]["whole"].items() if name in SERVICES
}
ZEROS = {"bool": False, "string": "", "wstring": "", "float64": 0.0, "float32": 0.0}

each_package = pytest.mark.parametrize("package", PACKAGES)
each_group = pytest.mark.parametrize("group", by_group(ALL))


def types_of(package, types):
    return [cls for name, cls in types.items() if name.startswith(f"{package}/")]


def as_ros_writes(name, definition):
    """A field of rosbags' type store as ROS writes it: `float64[9] covariance`."""
    kind, detail = definition
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        item, size = detail
        limit = "<=" if kind is Nodetype.SEQUENCE and size else ""
        return f"{as_ros_writes('', item).strip()}[{limit}{size or ''}] {name}"
    if kind is Nodetype.NAME:
        return f"{detail} {name}"
    base, bound = detail
    return f"{base}{f'<={bound}' if bound else ''} {name}"


@each_package
def test_stated_defaults_are_those_of_ros(package):
    for cls in types_of(package, ALL):
        fields = describe(cls)["type_description"]["fields"]
        stated = {each["name"]: each["default_value"] for each in fields if each["default_value"]}
        expected = CASES[type_name(cls)]["defaults"] if type_name(cls) in CASES else {}
        assert (type_name(cls), stated) == (
            type_name(cls),
            {name: json.dumps(value) for name, value in expected.items()},
        )


@each_package
def test_message_has_the_fields_of_ros(package):
    for name, cls in MESSAGES.items():
        if name.partition("/")[0] != package or name not in ROS.fielddefs:
            continue
        constants, fields = ROS.fielddefs[name]
        fields = [] if [field for field, _ in fields] == ["structure_needs_at_least_one_member"] else fields
        assert [name, *map(str, fields_of(cls))] == [name, *(as_ros_writes(*field) for field in fields)]
        assert [(each.name, each.base, each.value) for each in constants_of(cls)] == constants
        assert [getattr(cls, each.name) for each in constants_of(cls)] == [value for _, _, value in constants]


@each_package
def test_other_type_has_the_fields_of_ros(package):
    for name, case in CASES.items():
        if name.startswith(f"{package}/"):
            assert [name, *map(str, fields_of(ALL[name]))] == [name, *case["fields"]]
            assert [f"{each.base} {each.name}={each.value}" for each in constants_of(ALL[name])] == case["constants"]


@pytest.mark.parametrize("name", HASHES)
def test_type_has_the_hash_of_ros(name):
    assert rihs01(describe(ALL.get(name) or SERVICES[name])) == HASHES[name]


def test_each_package_is_complete():
    """Everything ROS defines in these packages is here, but for actions, and nothing else."""
    known = {name for name in [*ROS.fielddefs, *CASES] if name.split("/")[0] in PACKAGES}
    assert set(MESSAGES) == {name for name in known if "/msg/" in name}
    assert set(PARTS) == {name for name in known if "/msg/" not in name}


def test_service_that_cancels_goals_has_ros_hashes():
    """Those that rosidl computed; the event's covers the response."""
    expected = {each["type"]: each["rihs01"] for each in cases("g_rihs01", "action_msgs/srv/")}
    cancel = SERVICES["action_msgs/srv/CancelGoal"]
    assert {type_name(each): TypeSupport(each).type_hash for each in (cancel.Request, event_class(cancel))} == expected


@each_package
def test_missing_field_has_the_default_of_ros(package):
    for cls in types_of(package, ALL):
        check_defaults(cls)


def check_defaults(cls):
    stated = CASES.get(type_name(cls), {"defaults": {}})["defaults"]
    message = cls()
    for field in fields_of(cls):
        value = getattr(message, field.name)
        if field.array is ArrayKind.FIXED:
            assert value.tolist() == [0] * field.size
        elif field.array is not ArrayKind.NONE:
            assert len(value) == 0
        elif isinstance(field.base, str):
            expected = stated.get(field.name, ZEROS.get(field.base, 0))
            assert value == expected
            assert type(value) is PRIMITIVES[field.base].python
        else:
            assert value == field.base()


def test_ros_can_describe_every_standard_type():
    assert [name for name, cls in ALL.items() if not is_ros_type(cls)] == []


def test_type_is_found_by_full_and_short_name():
    for name in [*MESSAGES, *SERVICES]:
        package, _, word = name.split("/")
        assert type_name(find_type(name)) == name
        # Some services share their name with a message; the short name then means the message.
        assert find_type(f"{package}/{word}") in TYPES


@each_group
def test_any_message_survives_dump_json_and_pickle(group):
    for cls in group:
        check_survival(cls)


def check_survival(cls):
    @settings(max_examples=5)
    @given(messages(cls))
    def holds(message):
        assert cls.model_validate(message.model_dump()) == message
        assert cls.model_validate_json(message.model_dump_json()) == message
        assert cls.model_validate(json.loads(message.model_dump_json())) == message
        assert pickle.loads(pickle.dumps(message)) == message  # noqa: S301 - the pickle was made here
        assert copy.deepcopy(message) == message
        assert message.replace() == message
        for value in message.__dict__.values():
            assert not (isinstance(value, np.ndarray) and value.flags.writeable)

    holds()


@each_package
def test_json_schema_describes_a_dump(package):
    for cls in types_of(package, ALL):
        schema = cls.model_json_schema()
        assert schema["additionalProperties"] is False
        assert list(schema.get("properties", {})) == [field.name for field in fields_of(cls)]
        json.dumps(schema, allow_nan=False)


def test_the_package_itself_imports_nothing_heavy():
    """Naming `busflow.msgs` costs nothing; a package of messages is read when it is named."""
    code = "import sys, busflow.msgs; print([m for m in ('numpy', 'pydantic') if m in sys.modules])"
    assert printed_by(code) == "[]"


def test_finding_a_type_imports_only_its_package():
    code = (
        "import sys; from busflow.interfaces.message import find_type; find_type('std_msgs/Header');"
        "print(sorted(m for m in sys.modules if m.startswith('busflow.msgs.')))"
    )
    found = "['busflow.msgs.builtin_interfaces', 'busflow.msgs.std_msgs', 'busflow.msgs.std_msgs.header']"
    assert printed_by(code) == found
