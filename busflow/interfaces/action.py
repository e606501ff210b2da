"""`ActionType`: a goal, its result and its feedback, and the services and messages that ROS 2 derives of them."""

from __future__ import annotations

import types
from functools import cache
from typing import Any, ClassVar, NamedTuple

from busflow.errors import InvalidDeclaration, InvalidMessage
from busflow.interfaces.field_types import int8
from busflow.interfaces.message import Message, ServiceType, find_type, full_name, name_parts

PARTS = ("Goal", "Result", "Feedback")
"""The messages inside an action type."""


class ActionType:
    """A goal, its result, and what is reported on the way; subclasses hold them as `Goal`, `Result` and `Feedback`.

    >>> from busflow.interfaces.message import type_name
    >>> class MoveTo(ActionType, package="my_robot"):
    ...     class Goal(Message):
    ...         angle: float = 0.0
    ...     class Result(Message):
    ...         angle: float = 0.0
    ...     class Feedback(Message):
    ...         left: float = 0.0
    >>> type_name(MoveTo.Goal)
    'my_robot/action/MoveTo_Goal'
    """

    Goal: ClassVar[type[Message]]
    Result: ClassVar[type[Message]]
    Feedback: ClassVar[type[Message]]
    __ros_name__: ClassVar[str]

    def __init_subclass__(cls, *, package: str | None = None, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.__ros_name__ = full_name(cls, "action", package)
        name_parts(cls, PARTS)
        try:
            cls.Result()
        except InvalidMessage as error:
            raise InvalidDeclaration(
                f"{cls.__name__}.Result needs a default for each field, which a goal without a result gets: {error}"
            ) from None


class DerivedTypes(NamedTuple):
    """The types that ROS 2 derives of an action type, under its own names and hashes."""

    send_goal: type[ServiceType]
    """`…_SendGoal`: `goal_id` and `goal`, answered by `accepted` and `stamp`."""
    get_result: type[ServiceType]
    """`…_GetResult`: `goal_id`, answered by `status` and `result`."""
    feedback: type[Message]
    """`…_FeedbackMessage`: `goal_id` and `feedback`."""


@cache
def derived_types(action_type: type[ActionType]) -> DerivedTypes:
    """Return the derived types of an action type, one of each, so that all its users agree.

    >>> from busflow.interfaces.message import type_name
    >>> class Wave(ActionType, package="my_robot"):
    ...     class Goal(Message): ...
    ...     class Result(Message): ...
    ...     class Feedback(Message): ...
    >>> [type_name(each) for each in derived_types(Wave)]
    ['my_robot/action/Wave_SendGoal', 'my_robot/action/Wave_GetResult', 'my_robot/action/Wave_FeedbackMessage']
    """
    uuid = find_type("unique_identifier_msgs/msg/UUID")
    time: Any = find_type("builtin_interfaces/msg/Time")
    return DerivedTypes(
        _service(
            action_type,
            "SendGoal",
            request={"goal_id": uuid, "goal": action_type.Goal},
            response={"accepted": bool, "stamp": time},
            defaults={"accepted": False, "stamp": time()},
        ),
        _service(
            action_type,
            "GetResult",
            request={"goal_id": uuid},
            response={"status": int8, "result": action_type.Result},
            defaults={"status": 0, "result": action_type.Result()},
        ),
        _message(action_type, "FeedbackMessage", {"goal_id": uuid, "feedback": action_type.Feedback}, {}),
    )


def _service(
    action_type: type[ActionType],
    suffix: str,
    *,
    request: dict[str, Any],
    response: dict[str, Any],
    defaults: dict[str, Any],
) -> type[ServiceType]:
    halves = {
        "Request": _message(action_type, f"{suffix}_Request", request, {}),
        "Response": _message(action_type, f"{suffix}_Response", response, defaults),
    }
    names = {name: half.__ros_name__ for name, half in halves.items()}
    made: Any = _class(action_type, suffix, ServiceType, halves)
    for name, half in halves.items():  # which ServiceType has just named after itself
        half.__ros_name__ = names[name]
    return made


def _message(
    action_type: type[ActionType], suffix: str, annotations: dict[str, Any], defaults: dict[str, Any]
) -> type[Message]:
    made: Any = _class(action_type, suffix, Message, {"__annotations__": annotations, **defaults})
    return made


def _class(action_type: type[ActionType], suffix: str, base: type, body: dict[str, Any]) -> Any:
    """Return a class of a name that a class may have, with the name that ROS 2 gives its type."""
    ros_name = f"{action_type.__ros_name__}_{suffix}"
    text = f"`{ros_name}`, which ROS 2 derives of the action."
    keywords = {"package": ros_name.partition("/")[0]}
    name = f"{action_type.__name__}{suffix.replace('_', '')}"
    made: Any = types.new_class(
        name, (base,), keywords, lambda space: space.update(body, __module__=__name__, __doc__=text)
    )
    made.__ros_name__, made.__action__ = ros_name, action_type
    return made


def written_type(cls: type[Any]) -> type[Any]:
    """Return the class in a source file that a type comes of: the action's for one that is derived of it."""
    found: type[Any] = getattr(cls, "__action__", cls)
    return found
