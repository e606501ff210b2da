"""`@action` and `action_client`: what a node class says of actions, and the endpoints that come of it."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from dataclasses import replace
from inspect import iscoroutinefunction
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from busflow.actions.client import ActionClient, ClientEndpoints
from busflow.actions.endpoints import GoalClient, GoalServer, ResultServer, StatusPublisher
from busflow.actions.goal import F, G, Parts, R, RunningGoal
from busflow.actions.identifiers import Identifiers
from busflow.actions.names import CANCEL_GOAL, FEEDBACK, GET_RESULT, SEND_GOAL, STATUS
from busflow.actions.open_goals import AT_MOST, WhenBusy
from busflow.actions.server import CANCEL_WITHIN_S, ActionServer, ServerEndpoints, ServerOptions
from busflow.bus.qos import ACTION_STATUS_DEFAULT, QoS
from busflow.bus.services.server import DEPTH
from busflow.errors import InvalidDeclaration
from busflow.interfaces.action import ActionType, derived_types
from busflow.msgs.action_msgs import CancelGoal, GoalStatusArray
from busflow.node.declarations import ComposedDeclaration, checked_name
from busflow.node.node import runtime_of
from busflow.node.signatures import calling_line, line_of, takes_one
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.bus.endpoint import ServiceEndpoint
    from busflow.interfaces.message import ServiceType
    from busflow.node.runtime import NodeRuntime

A = TypeVar("A")
Accepting = TypeVar("Accepting", bound=Callable[[Any, Any], bool | str])
_FEEDBACK_QOS = QoS(depth=10)


class ActionDeclaration(ComposedDeclaration[ActionServer[A]], Generic[A]):
    """A method with `@action` above; on an instance the action's server."""

    def __init__(
        self, function: Callable[..., Any], action_type: type[ActionType], name: str, options: ServerOptions
    ) -> None:
        """Create the declaration that `@action(…)` makes of a method.

        Raises:
            InvalidDeclaration: the method is no `async def`, or does not take a goal.
        """
        shown = getattr(function, "__name__", "the method")
        kind = action_type.__name__
        wanted = f"write async def {shown}(self, goal: RunningGoal[{kind}]) -> {kind}.Result"
        if not iscoroutinefunction(function):
            raise InvalidDeclaration(
                f"@action needs an async method, because a cancel reaches a handler where it awaits: {wanted}"
            )
        if not takes_one(function):
            raise InvalidDeclaration(f"@action calls {shown} with the node and the goal: {wanted}")
        self.function = function
        self.written: tuple[str, int] | None = line_of(function)
        self.type = action_type
        self.action = name
        self.options = options
        self._accepts: str | None = None

    def accepts(self, function: Accepting) -> Accepting:
        """Ask a method whether a goal is accepted: it returns True, or the reason why not in words.

        Write `@move.accepts` above `def reachable(self, request: MoveTo.Goal) -> bool | str`, below the handler `move`.

        Raises:
            InvalidDeclaration: the method is an `async def`, or does not take a goal.
        """
        name = getattr(function, "__name__", "reachable")
        if iscoroutinefunction(function) or not takes_one(function):
            kind = self.type.__name__
            raise InvalidDeclaration(
                f"@{self.function.__name__}.accepts asks a plain method, which answers at once: write "
                f"def {name}(self, request: {kind}.Goal) -> bool | str"
            )
        self._accepts = name
        return function

    def renewed(self, function: Callable[..., Any]) -> ActionDeclaration[A]:
        """Return the same declaration for the method of a subclass that overrides this one."""
        made = ActionDeclaration[A](function, self.type, self.action, self.options)
        made._accepts = self._accepts  # its own class
        return made

    def compose(self, node: Any) -> ActionServer[A]:
        """Create the services and topics of a node's action."""
        runtime = runtime_of(node)
        types, name = derived_types(self.type), runtime.resolve(self.action, service=True).name
        server = ActionServer[A](
            name,
            self.type,
            types,
            self.options,
            handler=self.function.__get__(node),
            accepts=None if self._accepts is None else getattr(node, self._accepts),
            life=runtime.life,
            clock=runtime.surroundings.clock,
        )
        origin, line, layers = self.origin, self.written, runtime.surroundings.publisher_qos

        def endpoint(service_type: type[ServiceType], suffix: str) -> ServiceEndpoint:
            return _endpoint(self, runtime, service_type, suffix)

        server.endpoints = ServerEndpoints(
            goals=GoalServer(types.send_goal, endpoint(types.send_goal, SEND_GOAL), server.on_goal, server.open_goals),
            cancels=runtime.create_service(
                CancelGoal, name + CANCEL_GOAL, server.on_cancel, depth=DEPTH, origin=origin, line=line
            ),
            results=ResultServer(types.get_result, endpoint(types.get_result, GET_RESULT), server, server.open_goals),
            feedback=runtime.create_publisher(types.feedback, name + FEEDBACK, _FEEDBACK_QOS, origin=origin, line=line),
            status=StatusPublisher(
                runtime.endpoint(GoalStatusArray, name + STATUS, ACTION_STATUS_DEFAULT, layers, origin, line),
                server.statuses,
            ),
        )
        server.endpoints.goals.forget = server.cancel_all_of
        for own in (server.endpoints.status, server.endpoints.results, server.endpoints.goals):
            runtime.endpoints.add(own)
        return server


class ActionClientDeclaration(ComposedDeclaration[ActionClient[A]], Generic[A]):
    """A class attribute made by `action_client`."""

    def __init__(self, action_type: type[ActionType], action: str) -> None:
        self.type = action_type
        self.action = action
        self.written: tuple[str, int] | None = calling_line()

    def compose(self, node: Any) -> ActionClient[A]:
        """Create the endpoints of a node's client."""
        return create_client(self, runtime_of(node))


def create_client(declared: ActionClientDeclaration[A], runtime: NodeRuntime) -> ActionClient[A]:
    """Create a client of an action on a node, or on the program around a graph."""
    types, name = derived_types(declared.type), runtime.resolve(declared.action, service=True).name
    origin, line = declared.origin, declared.written
    goals = GoalClient(types.send_goal, _endpoint(declared, runtime, types.send_goal, SEND_GOAL))
    client = ActionClient[A](
        name, declared.type, types, runtime.surroundings.clock, Identifiers(runtime.surroundings, goals.endpoint)
    )
    client.endpoints = ClientEndpoints(
        goals=goals,
        cancels=runtime.create_client(CancelGoal, name + CANCEL_GOAL, origin=origin, line=line),
        results=runtime.create_client(types.get_result, name + GET_RESULT, origin=origin, line=line),
        feedback=runtime.create_subscription(
            types.feedback, name + FEEDBACK, client.on_feedback, _FEEDBACK_QOS, origin=origin, line=line
        ),
    )
    runtime.endpoints.add(goals)
    return client


def _endpoint(
    declared: ActionDeclaration[Any] | ActionClientDeclaration[Any],
    runtime: NodeRuntime,
    service_type: type[ServiceType],
    suffix: str,
) -> ServiceEndpoint:
    """Describe an endpoint of one of an action's services; it is written as the action is."""
    resolved = runtime.resolve(declared.action, service=True)
    endpoint = runtime.service_endpoint(service_type, resolved.name + suffix, declared.origin, declared.written)
    return replace(endpoint, written=declared.action, remap_rule=resolved.rule)


def action_client(action_type: type[Parts[G, R, F]], action: str) -> ActionClientDeclaration[Parts[G, R, F]]:
    """Send goals to an action.

    Write `move = action_client(MoveTo, "arm/move")` in the class, and `await self.move.run(MoveTo.Goal(…))` in its
    methods.
    """
    checked = checked_action_type(action_type, "action_client")
    return ActionClientDeclaration(checked, checked_name(action, f"action_client({checked.__name__}, …)", "action"))


def action(
    action_type: type[Parts[G, R, F]],
    name: str | None = None,
    *,
    when_busy: str = WhenBusy.REJECT,
    at_most: int = AT_MOST,
    cancel_within: float = CANCEL_WITHIN_S,
) -> _ActionDecorator[G, R, F]:
    """Serve an action.

    Write `@action(MoveTo, "~/move")` above `async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result`.
    A goal whose handler returns has succeeded. One whose handler raises is aborted, which is logged, and the node goes
    on. A cancel raises `CancelledError` where the handler awaits; a result that it returns nevertheless is the result
    of the canceled goal.

    Args:
        action_type: A class derived from `ActionType`.
        name: The action's name; without one it is refused in words.
        when_busy: What is done with a goal while another one runs. `reject` it, `queue` it, `replace` the other one,
            or run both in `parallel`.
        at_most: With `queue`, how many goals may wait; with `parallel`, how many may run. One more is rejected.
        cancel_within: Seconds after a cancel from which on a handler that goes on is named in the log.
    """
    checked = checked_action_type(action_type, "@action")
    if when_busy not in [*WhenBusy]:
        advice = did_you_mean(str(when_busy), [*WhenBusy])
        raise InvalidDeclaration(f"@action(…, when_busy={printable(repr(when_busy), limit=100)}): {advice}")
    if isinstance(at_most, bool) or not isinstance(at_most, int) or at_most < 1:  # type: ignore[redundant-expr]  # users without a type checker
        raise InvalidDeclaration(f"@action(…, at_most=…) is a whole number from 1, got {printable(repr(at_most))}")
    if not 0 < cancel_within < float("inf"):
        raise InvalidDeclaration(f"@action(…, cancel_within=…) is a number of seconds above 0, got {cancel_within!r}")
    options = ServerOptions(WhenBusy(when_busy), at_most, float(cancel_within))
    return _ActionDecorator(checked, checked_name(name, f"@action({checked.__name__}, …)", "action"), options)


class _ActionDecorator(Generic[G, R, F]):
    """The decorator that `@action(Type, name)` returns."""

    def __init__(self, action_type: type[ActionType], name: str, options: ServerOptions) -> None:
        self._type, self._name, self._options = action_type, name, options

    def __call__(
        self, function: Callable[[Any, RunningGoal[Any]], Coroutine[Any, Any, R]]
    ) -> ActionDeclaration[Parts[G, R, F]]:
        return ActionDeclaration(function, self._type, self._name, self._options)


def checked_action_type(action_type: Any, origin: str) -> type[ActionType]:
    """Return the type, if it is one of actions.

    Raises:
        InvalidDeclaration: it is anything else.
    """
    if isinstance(action_type, type) and issubclass(cast("type[Any]", action_type), ActionType):
        return cast("type[ActionType]", action_type)
    raise InvalidDeclaration(
        f"{origin} needs an action type, a class derived from ActionType, and then the action's name; "
        f"not {printable(action_type)!r}"
    )
