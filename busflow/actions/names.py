"""Names of an action's services and topics, as ROS 2 writes them."""

from __future__ import annotations

SEND_GOAL = "/_action/send_goal"
CANCEL_GOAL = "/_action/cancel_goal"
GET_RESULT = "/_action/get_result"
FEEDBACK = "/_action/feedback"
STATUS = "/_action/status"

_PART = "/_action/"


def action_of(name: str) -> str | None:
    """Return the action that a service or topic belongs to, or None.

    >>> action_of("/arm/move/_action/feedback"), action_of("/arm/move")
    ('/arm/move', None)
    """
    action, part, _ = name.rpartition(_PART)
    return action if part else None


def action_type_of(derived: str) -> str | None:
    """Return the name of the action type of which a type is derived, or None.

    >>> action_type_of("my_robot/action/MoveTo_SendGoal"), action_type_of("std_srvs/srv/Trigger")
    ('my_robot/action/MoveTo', None)
    """
    for suffix in ("_SendGoal", "_GetResult", "_FeedbackMessage"):
        if "/action/" in derived and derived.endswith(suffix):
            return derived.removesuffix(suffix)
    return None
