"""Declarations: what a node class says it publishes, receives and does periodically, without running it.

A declaration is an attribute of the class. It keeps what was written; `Node` turns it into an endpoint when a node
is made part of a graph, so that a graph is checked, drawn and documented before anything starts.
"""

from __future__ import annotations

import re
import sys
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from types import FrameType, FunctionType, SimpleNamespace
from typing import Any, Concatenate, Generic, ParamSpec, Self, TypeVar, cast, overload

from busflow.errors import InvalidDeclaration
from busflow.events import Event
from busflow.message import Message
from busflow.parameters import Parameters
from busflow.publishers import Publisher
from busflow.qos import QoS
from busflow.subscriptions import Subscription
from busflow.text import printable
from busflow.timers import Missed, Timer

M = TypeVar("M", bound=Message)
P = ParamSpec("P")
R = TypeVar("R")

NOT_ATTACHED = "{owner}.{name} is an endpoint only of a node that is part of a graph; see busflow.launch or the harness"


@dataclass(frozen=True, slots=True)
class SubscriptionRole:
    """One `@subscription` of a handler."""

    topic: str
    qos: QoS | None


@dataclass(frozen=True, slots=True)
class EventRole:
    """One `@on_event` of a handler."""

    topic: str


Role = SubscriptionRole | EventRole


class Declaration:
    """What a class attribute declares; the attribute's name comes from the class body."""

    name: str = ""
    owner: str = ""

    def __set_name__(self, owner: type, name: str) -> None:
        """Learn which attribute of which class this is."""
        self.owner, self.name = owner.__name__, name

    @property
    def origin(self) -> str:
        """The declaration for people: `SensorProcessor.on_imu`."""
        return f"{self.owner}.{self.name}"


class _Endpoint(Declaration, Generic[R]):
    """An attribute that is this declaration on the class and an endpoint on an instance.

    The instance's own dictionary holds the endpoint, under the same name, once its node is part of a graph.
    """

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type) -> R: ...
    def __get__(self, instance: object | None, owner: type) -> Self | R:
        if instance is None:
            return self
        if self.name in vars(instance):  # only super() asks here then, and it means the timer's method
            return vars(self)["function"].__get__(instance, owner)
        raise AttributeError(NOT_ATTACHED.format(owner=owner.__name__, name=self.name))


class PublisherDeclaration(_Endpoint[Publisher[M]]):
    """A class attribute made by `publisher`."""

    def __init__(self, message_type: type[M], topic: str, qos: QoS | None) -> None:
        self.type = _checked_type(message_type, "publisher")
        self.topic = topic
        self.qos = qos


class PullDeclaration(_Endpoint[Subscription[M]]):
    """A class attribute made by `subscription(Type, topic)`: to pull from."""

    def __init__(self, message_type: type[M], topic: str, qos: QoS | None) -> None:
        self.type = _checked_type(message_type, "subscription")
        self.topic = topic
        self.qos = qos


class Handler(Declaration, Generic[P, R]):
    """A method with `@subscription` or `@on_event` above it; on an instance it is the method."""

    def __init__(
        self,
        function: Callable[Concatenate[Any, P], R],
        roles: tuple[Role, ...],
        above: Handler[..., Any] | None = None,
    ) -> None:
        """The handler that a decorator makes of a method, or that overrides the one `above` without a decorator."""
        if isinstance(function, Declaration):
            raise InvalidDeclaration("@timer stands alone: give the timer and the handler methods of their own")
        self.function = function
        self.roles = roles
        self._above = above
        self._surroundings: Mapping[str, Any] = {}

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
        annotation = _message_annotation(self.function)
        if isinstance(annotation, str):
            self._surroundings = names_used(annotation, frame)

    def message_type(self) -> type[Message]:
        """The type of message that the handler's annotation states, the only place that does.

        Raises:
            InvalidDeclaration: there is no annotation, it cannot be resolved, or it is no message.
        """
        return _checked_type(self.annotated("message: Imu"), self.origin)

    def event_type(self) -> type[Event]:
        """The kind of event that the handler's annotation states.

        Raises:
            InvalidDeclaration: there is no annotation, it cannot be resolved, or it is no event.
        """
        found = self.annotated("event: DeadlineMissed")
        if not (isinstance(found, type) and issubclass(found, Event)):
            # Once each: a dataclass with slots is made anew, and the class it was made of may still be there.
            kinds = ", ".join(dict.fromkeys(kind.__name__ for kind in Event.__subclasses__()))
            raise InvalidDeclaration(f"{self.origin} must annotate the event it hears of, one of {kinds}")
        return found

    def annotated(self, example: str) -> Any:
        """What the handler's annotation names, or that of the method it overrides."""
        annotation = _message_annotation(self.function)
        if annotation is None and self._above is not None:
            return self._above.annotated(example)
        if annotation is None:
            raise InvalidDeclaration(
                f"{self.origin} must annotate what it takes: def {self.name}(self, {example}) -> None"
            )
        if isinstance(annotation, str):
            names = getattr(self.function, "__globals__", {})
            annotation = resolve(annotation, names, self._surroundings, self.origin)
        return annotation


class TimerDeclaration(_Endpoint[Timer]):
    """A method with `@timer` above it; on an instance it is the timer's handle, and calling it calls the method."""

    def __init__(
        self,
        function: Callable[[Any], Any],
        period_s: float | str | None,
        hz: float | str | None,
        missed: Missed,
    ) -> None:
        if isinstance(function, Declaration):
            raise InvalidDeclaration("@timer stands alone: give the timer and the handler methods of their own")
        self.function = function
        self.missed = missed
        self._period_s = period_s
        self._hz = hz

    def with_function(self, function: Callable[[Any], Any]) -> TimerDeclaration:
        """The same timer for the method of a subclass that overrides this one."""
        return TimerDeclaration(function, self._period_s, self._hz, self.missed)

    @property
    def parameter(self) -> str | None:
        """The parameter that decides the period, or None where it is fixed."""
        given = self._period_s if self._hz is None else self._hz
        return given if isinstance(given, str) else None

    def period(self, parameters: object) -> Fraction:
        """Seconds between ticks under these parameters; 0 is off.

        Raises:
            InvalidDeclaration: it names a parameter that does not exist or is no number.
        """
        given = self._period_s if self._hz is None else self._hz
        value: Any = given
        if isinstance(given, str):
            value = parameters
            for part in given.split("."):
                value = getattr(value, part, None)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InvalidDeclaration(
                f"{self.origin}: @timer names the parameter {given!r}, which is "
                f"{'not there' if value is None else f'no number but {printable(value)!r}'}"
            )
        try:
            number = Fraction(str(value))
        except ValueError:
            raise InvalidDeclaration(f"{self.origin}: a timer cannot run at {value!r}") from None
        return 1 / number if self._hz is not None and number else number


class ParametersDeclaration(Declaration):
    """A class's `parameters` annotation; on an instance the same name is the node's parameters."""

    def __init__(self, annotation: Any, frame: FrameType) -> None:
        self._annotation = annotation
        self._surroundings = names_used(annotation, frame) if isinstance(annotation, str) else {}

    def parameters_class(self, module: str) -> type[Parameters]:
        """The class that the annotation names.

        Raises:
            InvalidDeclaration: it cannot be resolved, or is no `Parameters` class.
        """
        found: Any = self._annotation
        if isinstance(found, str):
            found = resolve(found, vars(sys.modules[module]), self._surroundings, self.origin)
        if isinstance(found, type) and issubclass(cast("type[Any]", found), Parameters):
            return cast("type[Parameters]", found)
        raise InvalidDeclaration(
            f"{self.origin} must be annotated with a class derived from busflow.Parameters, not {printable(found)!r}"
        )


@overload
def subscription(topic: str, /, *, qos: QoS | None = None) -> _HandlerDecorator: ...
@overload
def subscription(message_type: type[M], topic: str, /, *, qos: QoS | None = None) -> PullDeclaration[M]: ...
def subscription(
    message_type: type[M] | str, topic: str | None = None, /, *, qos: QoS | None = None
) -> _HandlerDecorator | PullDeclaration[M]:
    """Receive a topic: above a handler, or as an attribute to pull from.

    Write `@subscription("imu/data")` above a method, or `imu = subscription(Imu, "imu/data")`. The handler's annotation
    states the type of message; a plain `def` is atomic, an `async def` is handed one message at a time. The attribute
    is pulled from: `async for`, `.latest`.
    """
    if isinstance(message_type, str):
        if topic is not None:
            raise InvalidDeclaration(f"@subscription({message_type!r}) takes nothing more but qos=, got {topic!r}")
        return _HandlerDecorator(SubscriptionRole(message_type, qos))
    if topic is None:
        raise InvalidDeclaration(f"subscription({message_type.__name__}, …) needs the topic's name after the type")
    return PullDeclaration(message_type, topic, qos)


def publisher(message_type: type[M], topic: str, *, qos: QoS | None = None) -> PublisherDeclaration[M]:
    """Publish a topic.

    Write `balance = publisher(Float64, "balance_state")` in the class, and `self.balance.publish(…)` in its methods.
    """
    return PublisherDeclaration(message_type, topic, qos)


def timer(
    period_s: float | str | None = None, *, hz: float | str | None = None, missed: str = Missed.SKIP
) -> Callable[[Callable[[Any], Any]], TimerDeclaration]:
    """Call a method periodically: `@timer(0.1)`, `@timer(hz=10)`, or `@timer(hz="rate_hz")` naming a parameter.

    A change of the parameter changes the timer; 0 is off. The first call comes after one period. A tick that could
    not be kept is skipped and counted, or made up for with `missed="burst"`.
    """
    if (period_s is None) == (hz is None):
        raise InvalidDeclaration("@timer takes either the period in seconds or hz=, and a number or a parameter's name")
    given = hz if period_s is None else period_s
    if not isinstance(given, str) and not _is_period(given):
        raise InvalidDeclaration(f"@timer(…) needs 0 (off), a positive number or a parameter's name, got {given!r}")
    policy = Missed(missed)
    return lambda function: TimerDeclaration(function, period_s, hz, policy)


def _is_period(given: object) -> bool:
    return isinstance(given, int | float) and not isinstance(given, bool) and 0 <= given < float("inf")


def on_event(topic: str) -> _HandlerDecorator:
    """Hear what happens to this node's own ends of a topic, besides messages.

    Write `@on_event("imu/data")` above a method whose annotation states the kind: `event: DeadlineMissed`.
    """
    return _HandlerDecorator(EventRole(topic))


class _HandlerDecorator:
    """What `@subscription(topic)` returns; above another one it adds a second, separate role."""

    def __init__(self, role: Role) -> None:
        self._role = role

    @overload
    def __call__(self, function: Handler[P, R]) -> Handler[P, R]: ...
    @overload
    def __call__(self, function: Callable[Concatenate[Any, P], R]) -> Handler[P, R]: ...
    def __call__(self, function: Handler[P, R] | Callable[Concatenate[Any, P], R]) -> Handler[P, R]:
        if isinstance(function, Handler):
            return Handler(function.function, (self._role, *function.roles))
        return Handler(function, (self._role,))


def declarations_of(node_class: type) -> dict[str, Declaration]:
    """The declarations of a class and its bases, by attribute, in the order they were first written."""
    found: dict[str, Declaration] = {}
    for owner in reversed(node_class.__mro__):
        for name, value in vars(owner).items():
            if isinstance(value, Declaration):
                found[name] = value
            else:
                found.pop(name, None)
    return found


def inherit(node_class: type, frame: FrameType) -> None:
    """Settle a new class's declarations: a method that overrides a handler without a decorator stays one."""
    for name in {name for base in node_class.__mro__ for name in vars(base)}:
        # The one who overrides may also be a mixin that knows nothing of nodes.
        value, above, *_ = [vars(base)[name] for base in node_class.__mro__ if name in vars(base)] + [None]
        renewed = _renewed(above, value) if isinstance(value, FunctionType) else None
        if renewed is not None:
            renewed.__set_name__(node_class, name)
            setattr(node_class, name, renewed)
    for value in vars(node_class).values():
        if isinstance(value, Handler):
            value.remember(frame)


def _renewed(above: object, function: FunctionType) -> Declaration | None:
    if isinstance(above, Handler):
        return Handler(function, above.roles, cast("Handler[..., Any]", above))
    if isinstance(above, TimerDeclaration):
        return above.with_function(function)
    return None


def names_used(annotation: str, frame: FrameType) -> dict[str, Any]:
    """What an annotation's words mean in the function around a class, where there is one."""
    words = set(re.findall(r"[A-Za-z_]\w*", annotation))
    return {word: frame.f_locals[word] for word in words if word in frame.f_locals}


def resolve(annotation: str, names: dict[str, Any], surroundings: Mapping[str, Any], origin: str) -> Any:
    """The object that an annotation names.

    Raises:
        InvalidDeclaration: a name in it is not known when the program runs.
    """
    holder = SimpleNamespace(__annotations__={"it": annotation})
    try:
        return typing.get_type_hints(holder, names, dict(surroundings))["it"]
    except NameError as error:
        raise InvalidDeclaration(
            f"{origin} is annotated with {annotation!r}, but {error.name!r} is not defined when the program runs; "
            "import it outside `if TYPE_CHECKING:`"
        ) from None
    except (SyntaxError, TypeError, AttributeError) as error:
        raise InvalidDeclaration(f"{origin} is annotated with {annotation!r}: {error}") from None


def _message_annotation(function: Callable[..., Any]) -> Any:
    """The annotation of the first parameter after `self`, as written, or None."""
    code = getattr(function, "__code__", None)
    if code is None or code.co_argcount < 2:
        return None
    return getattr(function, "__annotations__", {}).get(code.co_varnames[1])


def _checked_type(message_type: Any, origin: str) -> Any:
    if not (isinstance(message_type, type) and issubclass(cast("type[Any]", message_type), Message)):
        raise InvalidDeclaration(
            f"{origin} needs a message type, a class derived from busflow.Message, not {printable(message_type)!r}"
        )
    return message_type


def calling_frame() -> FrameType:
    """The frame in which the class statement stands whose `__init_subclass__` calls this."""
    return sys._getframe(2)  # noqa: SLF001  # the only way to see a class's surroundings; CPython 3.11–3.13 have it
