"""A description says of a type what ROS 2 says of it, hashes as ROS 2 hashes it, and is checked when a peer sent it."""

import contextlib
import copy
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from busflow.definitions.recorded import parse
from busflow.errors import MalformedMessage, UnknownType
from busflow.interfaces.action import derived_types
from busflow.interfaces.encoding.description import (
    DEPTH,
    Count,
    Field,
    action_types,
    assemble,
    check,
    fields_of,
    individual,
    is_rihs01,
    rihs01,
    service_types,
    types_in,
)
from busflow.interfaces.encoding.typesupport import describe
from busflow.interfaces.message import find_type
from busflow.msgs.example_interfaces import Fibonacci
from busflow.msgs.geometry_msgs import PoseStamped
from busflow.msgs.rcl_interfaces import GetParameters
from busflow.msgs.service_msgs import ServiceEventInfo
from busflow.msgs.std_msgs import Empty
from tests.vectors import each_case, suite

FORMS = suite("g_rihs01")["string_form_cases"]
SERVICES = {case["id"]: case for case in suite("ros2_services")["cases"]}
ROS = get_typestore(Stores.LATEST)


def of_ros(name):
    """The description of a type of ROS 2: from busflow's class, from rosbags' definition, or from a service's file."""
    service = name
    for part in ("_Request", "_Response", "_Event"):
        service = service.removesuffix(part) if "/srv/" in name else service
    try:
        types = types_in(describe(find_type(service)))
    except UnknownType:
        types = types_of_a_file(service) if service in SERVICES else types_in(of_rosbags(name))
    return assemble(name, types)


def of_rosbags(name):
    return parse(name, ROS.generate_msgdef(name, ros_version=2)[0])


def types_of_a_file(service):
    types = types_in(describe(ServiceEventInfo))
    for part in ("request", "response"):
        text = SERVICES[service][part]
        package = service.partition("/")[0]
        words = {line.split()[0].partition("[")[0] for line in text.splitlines()}
        nested = [word if "/" in word else f"{package}/{word}" for word in words if not word.islower() or "/" in word]
        needed = {}
        for word in nested:
            needed |= types_in(of_rosbags(word.replace("/", "/msg/")))
        whole = [f"{'=' * 80}\nMSG: {each}\n{ROS.generate_msgdef(each, ros_version=2)[0]}" for each in needed]
        types |= types_in(parse(f"{service}_{part.title()}", "\n".join([text, *whole])))
    return types | {each["type_name"]: each for each in service_types(service)}


@each_case("g_rihs01")
def test_a_type_has_the_hash_of_ros(case):
    assert rihs01(of_ros(case["type"])) == case["rihs01"]


@pytest.mark.parametrize("text", FORMS["valid"])
def test_a_hash_is_recognised(text):
    assert is_rihs01(text)


@pytest.mark.parametrize("text", [*FORMS["invalid"], "", "RIHS01_" + "A" * 64])
def test_what_is_no_hash_is_not(text):
    assert not is_rihs01(text)


def test_a_hash_ignores_defaults_constants_and_key_order():
    described = describe(PoseStamped)
    other = json.loads(json.dumps(described, sort_keys=True))
    other["type_description"]["constants"] = [{"name": "A", "type": "int8", "value": "1"}]
    for field in other["type_description"]["fields"]:
        field["default_value"] = "7"
    assert rihs01(check(other)) == rihs01(described)


def test_a_type_without_fields_has_the_dummy_field():
    assert [field.name for field in fields_of(describe(Empty)["type_description"])] == [
        "structure_needs_at_least_one_member"
    ]


def test_the_types_inside_are_sorted_and_complete(golden):
    inner = [each["type_name"] for each in describe(PoseStamped)["referenced_type_descriptions"]]
    assert inner == sorted(inner)
    golden("\n".join(inner))


def test_a_service_is_described_with_parts_and_event(golden):
    golden("\n".join(sorted(types_in(describe(GetParameters)))))


def test_a_description_that_was_json_is_the_same():
    for name in ("geometry_msgs/PoseStamped", "diagnostic_msgs/DiagnosticArray", "rcl_interfaces/srv/GetParameters"):
        described = describe(find_type(name))
        assert check(json.loads(json.dumps(described))) == described


def nested(depth):
    """Types a/msg/T0 … that lie within each other so deep."""
    types = [individual("a/msg/T0", [Field("x", "int8").describe()])]
    types += [
        individual(f"a/msg/T{i}", [Field("inner", f"a/msg/T{i - 1}", nested=True).describe()]) for i in range(1, depth)
    ]
    return {each["type_name"]: each for each in types}


def test_types_nest_up_to_a_limit():
    assemble(f"a/msg/T{DEPTH - 1}", nested(DEPTH))
    with pytest.raises(MalformedMessage, match=str(DEPTH)):
        assemble(f"a/msg/T{DEPTH}", nested(DEPTH + 1))


def test_known_type_counts_where_it_lies_deeper():
    types = nested(DEPTH - 1)
    inner = f"a/msg/T{DEPTH - 2}"

    def add(name: str, *holds: str) -> None:
        fields = [Field(f"f{i}", each, nested=True).describe() for i, each in enumerate(holds)]
        types[name] = individual(name, fields)

    add("a/msg/Top", inner)
    assemble("a/msg/Top", types)
    add("a/msg/Middle", inner)
    add("a/msg/Top", inner, "a/msg/Middle")
    with pytest.raises(MalformedMessage, match=str(DEPTH)):
        assemble("a/msg/Top", types)


def test_many_ways_to_one_type_are_found_quickly():
    """Each type holds the one below twice: 2^31 ways to the innermost."""
    types = nested(DEPTH)
    for each in types.values():
        each["fields"].append({**each["fields"][0], "name": "again"})
    assert len(types_in(assemble(f"a/msg/T{DEPTH - 1}", types))) == DEPTH


def test_a_type_that_holds_itself_is_refused():
    types = nested(3)
    types["a/msg/T0"]["fields"].append(Field("outer", "a/msg/T2", nested=True, count=Count.UNBOUNDED).describe())
    with pytest.raises(MalformedMessage, match="a/msg/T2"):
        assemble("a/msg/T2", types)


def changed(path, value):
    described = copy.deepcopy(describe(PoseStamped))
    target = described
    for key in path[:-1]:
        target = target[key]
    target[path[-1]] = value
    return described


FIELD = ("type_description", "fields", 0)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("type_description",), None),
        (("type_description", "type_name"), "Pose Stamped"),
        (("type_description", "fields"), {}),
        (("type_description", "fields"), []),
        (("type_description", "fields", 1), describe(PoseStamped)["type_description"]["fields"][0]),
        (("type_description", "constants"), [{"name": "A", "type": ["int8"], "value": "1"}]),
        ((*FIELD, "name"), "a; import os"),
        ((*FIELD, "name"), 3),
        ((*FIELD, "default_value"), 3),
        ((*FIELD, "type", "type_id"), 0),
        ((*FIELD, "type", "type_id"), 12),
        ((*FIELD, "type", "type_id"), 3),
        ((*FIELD, "type", "type_id"), 193),
        ((*FIELD, "type", "type_id"), True),
        ((*FIELD, "type", "type_id"), -1),
        ((*FIELD, "type", "type_id"), 49),
        ((*FIELD, "type", "capacity"), 1 << 32),
        ((*FIELD, "type", "nested_type_name"), "std_msgs/msg/Headr"),
        (("referenced_type_descriptions",), None),
        (("referenced_type_descriptions", 0), describe(PoseStamped)["type_description"]),
    ],
)
def test_an_unreliable_description_is_refused(golden, path, value):
    with golden.raises(MalformedMessage):
        check(changed(path, value))


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@given(data=st.data())
def test_any_description_is_checked_without_a_crash(data):
    described = json.loads(json.dumps(describe(PoseStamped)))
    target, key = described, "type_description"
    while True:
        inner = target[key]
        keys = list(inner) if isinstance(inner, dict) else list(range(len(inner))) if isinstance(inner, list) else []
        if not keys or data.draw(st.integers(0, 3)) == 0:
            break
        target, key = inner, data.draw(st.sampled_from(keys))
    target[key] = data.draw(json_values)
    with contextlib.suppress(MalformedMessage):
        check(described)


def test_derived_types_are_those_of_the_class():
    described = {each["type_name"]: each for each in action_types("example_interfaces/action/Fibonacci")}
    derived = derived_types(Fibonacci)
    for cls in (derived.send_goal.Request, derived.send_goal.Response, derived.get_result.Response, derived.feedback):
        expected = describe(cls)["type_description"]
        assert described[expected["type_name"]]["fields"] == expected["fields"]
