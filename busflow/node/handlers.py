"""Handler: a method of a node class that is called with something, and the decorators that say with what."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass
from importlib import import_module
from types import FrameType, FunctionType
from typing import Any, Concatenate, Generic, ParamSpec, Self, TypeVar, overload

from busflow.bus.events import Event
from busflow.bus.qos import QoS, checked_qos
from busflow.bus.services.call import Pair, Req, Res
from busflow.bus.services.server import DEPTH
from busflow.errors import InvalidDeclaration
from busflow.interfaces.message import Message, ServiceType, type_name
from busflow.node.declarations import (
    ComposedDeclaration,
    Declaration,
    PullDeclaration,
    checked_name,
    checked_service_type,
    checked_type,
)
from busflow.node.signatures import line_of, message_annotation, names_used, resolve, takes_one
from busflow.text import printable
from busflow.validation.as_written import written_annotations

M = TypeVar("M", bound=Message)
P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class SubscriptionRole:
    """One `@subscription` of a handler."""

    topic: str
    qos: QoS | None


@dataclass(frozen=True, slots=True)
class EventRole:
    """One `@on_event` of a handler."""

    topic: str


@dataclass(frozen=True, slots=True)
class ServiceRole:
    """One `@service` of a handler."""

    type: type[ServiceType]
    service: str
    depth: int


NOT_STATED = object()
"""Stands for a missing annotation; None would be a valid one."""


@dataclass(frozen=True, slots=True)
class ParametersRole:
    """The `@on_parameters` of a handler."""


_EXAMPLES: dict[type, tuple[str, str]] = {
    SubscriptionRole: ("@subscription", "message: Imu"),
    EventRole: ("@on_event", "event: DeadlineMissed"),
}

Role = SubscriptionRole | EventRole | ServiceRole | ParametersRole


class Handler(Declaration, Generic[P, R]):
    """A method with `@subscription`, `@service`, `@on_event` or `@on_parameters` above; on an instance the method."""

    def __init__(
        self,
        function: Callable[Concatenate[Any, P], R],
        roles: tuple[Role, ...],
        above: Handler[..., Any] | None = None,
    ) -> None:
        """Create the handler of a decorated method, or of one that overrides `above` without a decorator."""
        if isinstance(function, Declaration):
            raise InvalidDeclaration("@timer stands alone: give the timer and the handler methods of their own")
        if len(roles) > 1 and ParametersRole() in roles:
            raise InvalidDeclaration("@on_parameters stands alone: a message or an event needs a method of its own")
        for role in roles:
            if isinstance(role, SubscriptionRole | EventRole) and not takes_one(function):
                decorator, example = _EXAMPLES[type(role)]
                name = getattr(function, "__name__", "on_message")
                raise InvalidDeclaration(
                    f"{decorator} calls {name} with the node and one thing more: write def {name}(self, {example})"
                )
        self.function = function
        self.written: tuple[str, int] | None = line_of(function)
        self.roles = roles
        self._above = above
        self._surroundings: Mapping[str, Any] = {}

    def renewed(self, function: FunctionType) -> Handler[..., Any]:
        """Return the handler of a subclass's method that overrides this one without a decorator."""
        return Handler(function, self.roles, self)

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type) -> Callable[P, R]: ...
    def __get__(self, instance: object | None, owner: type) -> Self | Callable[P, R]:
        if instance is None:
            return self
        return self.function.__get__(instance, owner)  # type: ignore[attr-defined]  # a function in a class body

    def remember(self, frame: FrameType) -> None:
        """Keep what the annotation names of the class's surroundings, for when it is resolved."""
        annotations = (message_annotation(self.function), _return_annotation(self.function))
        self._surroundings = names_used(" ".join(each for each in annotations if isinstance(each, str)), frame)

    def message_type(self) -> type[Message]:
        """Return the type of message that the handler's annotation states, the only place that does.

        Raises:
            InvalidDeclaration: there is no annotation, it cannot be resolved, or it is no message.
        """
        return checked_type(self.annotated("message: Imu"), self.origin)

    def event_type(self) -> type[Event]:
        """Return the kind of event that the handler's annotation states.

        Raises:
            InvalidDeclaration: there is no annotation, it cannot be resolved, or it is no event.
        """
        found = self.annotated("event: DeadlineMissed")
        if not (isinstance(found, type) and issubclass(found, Event)):
            # Once each: a dataclass with slots is made anew, and the class it was made of may still be there.
            kinds = ", ".join(dict.fromkeys(kind.__name__ for kind in Event.__subclasses__()))
            raise InvalidDeclaration(f"{self.origin} must annotate the event it handles, one of {kinds}")
        return found

    def annotated(self, example: str) -> Any:
        """Return the type in the handler's annotation, or in that of the method it overrides."""
        annotation = message_annotation(self.function)
        if annotation is None and self._above is not None:
            return self._above.annotated(example)
        if annotation is None:
            raise InvalidDeclaration(
                f"{self.origin} must annotate what it takes: def {self.name}(self, {example}) -> None"
            )
        return self._resolved(annotation)

    def check_service(self, service_type: type[ServiceType]) -> None:
        """Compare what the handler's annotations state, where there are any, with the service's type.

        Raises:
            InvalidDeclaration: it takes or returns something else.
        """
        kind = service_type.__name__
        wanted = (
            f"{self.origin} answers {type_name(service_type)}: write def {self.name}(self, request: {kind}.Request)"
        )
        wanted += f" -> {kind}.Response"
        if not takes_one(self.function):
            raise InvalidDeclaration(f"{wanted}; it is called with the request, and returns the response it makes")
        for verb, annotation, expected in (
            ("takes", message_annotation(self.function) or NOT_STATED, service_type.Request),
            ("returns", _return_annotation(self.function), service_type.Response),
        ):
            if annotation is not NOT_STATED and (found := self._resolved(annotation)) is not expected:
                raise InvalidDeclaration(f"{wanted}; it {verb} {printable(found, limit=200)}")

    def _resolved(self, annotation: Any) -> Any:
        if isinstance(annotation, str):
            names = getattr(self.function, "__globals__", {})
            return resolve(annotation, names, self._surroundings, self.origin)
        return annotation


_FEATURES = {"in_frame": "busflow.pairing.in_frame", "wait": "busflow.pairing.in_frame"}
"""The module of the feature that each further keyword of `@subscription` belongs to; imported when one is given."""


@overload
def subscription(topic: str, /, *, qos: QoS | None = None) -> HandlerDecorator: ...
@overload
def subscription(
    topic: str, /, *, qos: QoS | None = None, in_frame: str, wait: str | float = 0.1
) -> Callable[[Callable[Concatenate[Any, P], R]], ComposedDeclaration[Callable[P, R]]]: ...
@overload
def subscription(message_type: type[M], topic: str, /, qos: QoS | None = None) -> PullDeclaration[M]: ...
def subscription(
    message_type: type[M] | str, topic: str | None = None, /, qos: QoS | None = None, **keywords: Any
) -> Any:
    """Receive a topic: above a handler, or as an attribute to pull from.

    Write `@subscription("imu/data")` above a method, or `imu = subscription(Imu, "imu/data")`. The handler's annotation
    states the type of message; a plain `def` is atomic, an `async def` is handed one message at a time. The attribute
    is pulled from: `async for`, `.latest`.

    With `in_frame="map"` a message is handed over once the transform from its frame to `map` at its stamp is there;
    after `wait`, 100 ms unless said, it is a drop with the reason `no_transform`.
    """
    for keyword, value in keywords.items():
        if keyword not in _FEATURES:
            raise TypeError(f"subscription() got an unexpected keyword argument {keyword!r}")
        if value is not None:
            return import_module(_FEATURES[keyword]).subscription(message_type, topic, qos=qos, **keywords)
    if isinstance(message_type, str):
        if isinstance(topic, type):
            raise InvalidDeclaration(f'the type comes first: write subscription({topic.__name__}, "{message_type}")')
        if topic is not None:
            raise InvalidDeclaration(f"@subscription(…) takes nothing more but qos=QoS(depth=…), got {topic!r}")
        return HandlerDecorator(SubscriptionRole(message_type, checked_qos(qos, "@subscription(…)")))
    if not isinstance(message_type, type):  # type: ignore[redundant-expr]  # users without a type checker
        raise _bare("@subscription", "a topic's name", '"imu/data"', message_type)
    if topic is None:
        raise InvalidDeclaration(f"subscription({message_type.__name__}, …) needs the topic's name after the type")
    return PullDeclaration(message_type, topic, qos)


def _bare(decorator: str, needs: str, example: str, method: object) -> InvalidDeclaration:
    """Return the error of a decorator without its arguments."""
    name = getattr(method, "__name__", "the method")
    return InvalidDeclaration(f"{decorator} needs {needs}: write {decorator}({example}) above {name}")


def on_event(topic: str) -> HandlerDecorator:
    """Handle events of this node's own endpoints of a topic.

    Write `@on_event("imu/data")` above a method whose annotation states the kind: `event: DeadlineMissed`.
    """
    if callable(topic):  # users without a type checker
        raise _bare("@on_event", "a topic's name", '"imu/data"', topic)
    return HandlerDecorator(EventRole(checked_name(topic, "@on_event(…)", "topic")))


def on_parameters(function: Callable[Concatenate[Any, P], R]) -> Handler[P, R]:
    """Handle changes of the node's parameters: `@on_parameters` above `def retune(self, old: MyParameters)`.

    It is called after the change, with the parameters before it; `self.parameters` holds the new ones. Refusing
    belongs in the validators of the `Parameters` class. Of an `async def` one call runs at a time: what changes
    meanwhile is reported in one more call, whose `old` is what the call before saw as new.
    """
    if isinstance(function, Handler):
        raise InvalidDeclaration("@on_parameters stands alone: a message or an event needs a method of its own")
    code = getattr(function, "__code__", None)
    if code is not None and code.co_argcount != 2:
        raise InvalidDeclaration(f"@on_parameters needs a method written as def {code.co_name}(self, old)")
    return Handler(function, (ParametersRole(),))


def service(
    service_type: type[Pair[Req, Res]], name: str | None = None, *, depth: int = DEPTH
) -> _ServiceDecorator[Req, Res]:
    """Answer a service.

    Write `@service(Trigger, "~/reset")` above a method that takes a `Trigger.Request` and returns a
    `Trigger.Response`; a plain `def` is atomic, an `async def` answers one request at a time. An exception is reported
    to the caller and logged; the node goes on.

    Args:
        service_type: A class derived from `ServiceType`.
        name: The service's name; without one the call is refused in words.
        depth: How many requests may wait; the next one is refused at once.
    """
    if isinstance(service_type, FunctionType):  # pyright: ignore[reportUnnecessaryIsInstance]  # users without a type checker
        raise _bare("@service", "a service type and a name", 'Trigger, "~/reset"', service_type)
    checked = checked_service_type(service_type, "@service")
    return _ServiceDecorator(
        ServiceRole(checked, checked_name(name, f"@service({checked.__name__}, …)", "service"), depth)
    )


class _ServiceDecorator(Generic[Req, Res]):
    """The decorator that `@service(Type, name)` returns; above another one the method answers both."""

    def __init__(self, role: ServiceRole) -> None:
        self._role = role

    @overload
    def __call__(self, function: Handler[[Req], R]) -> Handler[[Req], R]: ...
    @overload
    def __call__(
        self, function: Callable[[Any, Req], Coroutine[Any, Any, Res]]
    ) -> Handler[[Req], Coroutine[Any, Any, Res]]: ...
    @overload
    def __call__(self, function: Callable[[Any, Req], Res]) -> Handler[[Req], Res]: ...
    def __call__(self, function: Any) -> Any:
        return HandlerDecorator(self._role)(function)


class HandlerDecorator:
    """The decorator that `@subscription(topic)` returns; above another one it adds a second, separate role."""

    def __init__(self, role: Role) -> None:
        self._role = role

    @overload
    def __call__(self, function: Handler[P, R]) -> Handler[P, R]: ...
    @overload
    def __call__(self, function: Callable[Concatenate[Any, P], R]) -> Handler[P, R]: ...
    def __call__(self, function: Handler[P, R] | Callable[Concatenate[Any, P], R]) -> Handler[P, R]:
        """Return the handler that the method is now, with one role more if it was one."""
        if isinstance(function, Handler):
            return Handler(function.function, (self._role, *function.roles))
        return Handler(function, (self._role,))


def _return_annotation(function: Callable[..., Any]) -> Any:
    return written_annotations(function).get("return", NOT_STATED) if isinstance(function, FunctionType) else NOT_STATED


def declarations_of(node_class: type) -> dict[str, Declaration]:
    """Return the declarations of a class and its bases, by attribute, in the order they were first written."""
    found: dict[str, Declaration] = {}
    for owner in reversed(node_class.__mro__):
        for name, value in vars(owner).items():
            if isinstance(value, Declaration):
                found[name] = value
            elif name in found:
                del found[name]
    return found


def inherit(node_class: type, frame: FrameType) -> None:
    """Settle a new class's declarations: a method that overrides a handler without a decorator stays one."""
    for name in {name for base in node_class.__mro__ for name in vars(base)}:
        # The overriding class may also be a mixin without nodes among its bases.
        value, above, *_ = [vars(base)[name] for base in node_class.__mro__ if name in vars(base)] + [None]
        overrides = isinstance(value, FunctionType) and isinstance(above, Declaration)
        if overrides and (renewed := above.renewed(value)) is not None:
            renewed.__set_name__(node_class, name)
            setattr(node_class, name, renewed)
    for value in vars(node_class).values():
        if isinstance(value, Declaration):
            value.remember(frame)
