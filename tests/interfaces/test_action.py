"""An action type has inside it what its user writes, and ROS 2's derived types beside it."""

import pytest
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from busflow.errors import InvalidDeclaration
from busflow.interfaces.action import ActionType, derived_types, written_type
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import Length, Message, type_name
from busflow.msgs.example_interfaces import Fibonacci
from busflow.msgs.geometry_msgs import Point
from busflow.msgs.unique_identifier_msgs import UUID


class Reach(ActionType, package="my_robot"):
    """One with nested types, and with empty parts."""

    class Goal(Message):
        """Where."""

        target: Point = Point()
        names: tuple[str, ...] = ()

    class Result(Message):
        """Nothing."""

    class Feedback(Message):
        """Nothing."""


DEFINITIONS = {
    Fibonacci: ("int32 order", "int32[] sequence", "int32[] sequence"),
    Reach: ("geometry_msgs/Point target\nstring[] names", "", ""),
}
DERIVED = {
    "SendGoal_Request": "unique_identifier_msgs/UUID goal_id\n{name}_Goal goal",
    "SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp",
    "GetResult_Request": "unique_identifier_msgs/UUID goal_id",
    "GetResult_Response": "int8 status\n{name}_Result result",
    "FeedbackMessage": "unique_identifier_msgs/UUID goal_id\n{name}_Feedback feedback",
}
EVENT = "service_msgs/ServiceEventInfo info\n{name}_Request[<=1] request\n{name}_Response[<=1] response"
SERVICE = "{name}_Request request_message\n{name}_Response response_message\n{name}_Event event_message"


def as_rosbags_knows(action_type):
    """rosbags' own reading of an action's types, as rosidl derives them, in a store of theirs."""
    store, name = get_typestore(Stores.LATEST), action_type.__ros_name__
    # rosbags hashes this field's char[16] as char; rosidl, which decides, as uint8.
    constants, (kind, stamp, _, number) = store.fielddefs["service_msgs/msg/ServiceEventInfo"]
    gid = ("client_gid", (Nodetype.ARRAY, ((Nodetype.BASE, ("uint8", 0)), 16)))
    store.fielddefs["service_msgs/msg/ServiceEventInfo"] = constants, [kind, stamp, gid, number]
    parts = dict(zip(("Goal", "Result", "Feedback"), DEFINITIONS[action_type], strict=True)) | DERIVED
    parts |= {f"{each}_Event": EVENT.replace("{name}", f"{{name}}_{each}") for each in ("SendGoal", "GetResult")}
    parts |= {each: SERVICE.replace("{name}", f"{{name}}_{each}") for each in ("SendGoal", "GetResult")}
    for suffix, text in parts.items():
        # rosbags reads `.msg` files, and these names are not of its `msg`: a type beside another is named whole.
        store.register(get_types_from_msg(text.format(name=name), f"{name}_{suffix}"))
    return store


@pytest.mark.parametrize("action_type", DEFINITIONS)
def test_hashes_are_those_of_rosbags(action_type):
    store, name = as_rosbags_knows(action_type), action_type.__ros_name__
    derived = derived_types(action_type)
    ours = [action_type.Goal, action_type.Result, action_type.Feedback, *derived]
    ours += [half for each in derived[:2] for half in (each.Request, each.Response)]
    assert {type_name(each): TypeSupport(each).type_hash for each in ours} == {
        f"{name}_{suffix}": store.hash_rihs01(f"{name}_{suffix}")
        for suffix in ("Goal", "Result", "Feedback", "SendGoal", "GetResult", *DERIVED)
    }


def test_bytes_of_a_request_are_those_of_rosbags():
    store, request = as_rosbags_knows(Fibonacci), derived_types(Fibonacci).send_goal.Request
    ours = TypeSupport(request).encode(request(goal_id=UUID(uuid=list(range(16))), goal=Fibonacci.Goal(order=7)))
    theirs = store.deserialize_cdr(ours, type_name(request))
    assert (bytes(theirs.goal_id.uuid), theirs.goal.order) == (bytes(range(16)), 7)
    assert bytes(store.serialize_cdr(theirs, type_name(request))) == ours


def test_each_user_gets_the_same_types():
    assert derived_types(Fibonacci) is derived_types(Fibonacci)


@pytest.mark.parametrize("missing", ["Goal", "Result", "Feedback"])
def test_action_without_a_part_is_refused(golden, missing):
    body = {part: type(part, (Message,), {"__module__": __name__}) for part in ("Goal", "Result", "Feedback")}
    del body[missing]
    with golden.raises(InvalidDeclaration):
        type("MoveTo", (ActionType,), body)


def test_result_without_a_default_is_refused(golden):
    with golden.raises(InvalidDeclaration):

        class Late(ActionType, package="my_robot"):
            class Goal(Message):
                pass

            class Result(Message):
                angle: float

            class Feedback(Message):
                pass


def test_goal_may_require_its_fields():
    class Exact(ActionType, package="my_robot"):
        class Goal(Message):
            names: tuple[str, ...]

        class Result(Message):
            pass

        class Feedback(Message):
            pass

    request = derived_types(Exact).send_goal.Request(goal_id=UUID(), goal=Exact.Goal(names=("a",)))
    assert request.goal.names == ("a",)


def test_bound_of_a_field_changes_the_hash():
    def of(annotation):
        goal = type("Goal", (Message,), {"__module__": __name__, "__annotations__": {"names": annotation}, "names": ()})
        empty = {part: type(part, (Message,), {"__module__": __name__}) for part in ("Result", "Feedback")}
        made = type("Named", (ActionType,), {"Goal": goal, **empty, "__module__": __name__})
        return TypeSupport(derived_types(made).send_goal).type_hash

    from typing import Annotated

    assert of(tuple[str, ...]) != of(Annotated[tuple[str, ...], Length(max=3)])


def test_derived_type_comes_of_the_written_one():
    assert written_type(derived_types(Fibonacci).send_goal) is Fibonacci
    assert written_type(Point) is Point
