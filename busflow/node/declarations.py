"""Declarations: what a node class says it publishes, receives and does periodically, without running it.

A declaration is an attribute of the class. It keeps what was written; `Node` turns it into an endpoint when a node
is made part of a graph, so that a graph is checked, drawn and documented before anything starts.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from fractions import Fraction
from types import FrameType, FunctionType
from typing import Any, Generic, NoReturn, Self, TypeVar, cast, overload

from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS, checked_qos
from busflow.bus.services.call import Pair, Req, Res
from busflow.bus.services.client import Client
from busflow.bus.subscription import Subscription
from busflow.bus.timer import Missed, Timer
from busflow.errors import InvalidDeclaration, Place
from busflow.interfaces.message import Message, ServiceType
from busflow.node.parameters import Parameters
from busflow.node.signatures import calling_line, line_of, names_used, resolve, takes_none
from busflow.text import printable
from busflow.validation.tracebacks import line

M = TypeVar("M", bound=Message)
E = TypeVar("E")

NOT_ATTACHED = "{owner}.{name} is an endpoint only of a node that is part of a graph; see busflow.launch or the harness"


class Declaration:
    """The declaration of a class attribute; the attribute's name comes from the class body."""

    name: str = ""
    owner: str = ""
    written: tuple[str, int] | None = None
    """The file and the line where it is written."""

    def __set_name__(self, owner: type, name: str) -> None:
        """Learn which attribute of which class this is."""
        self.owner, self.name = owner.__name__, name

    @property
    def place(self) -> Place | None:
        """The place in the source, for errors."""
        return line(*self.written) if self.written is not None else None

    @property
    def origin(self) -> str:
        """The declaration for people: `SensorProcessor.on_imu`."""
        return f"{self.owner}.{self.name}"

    def remember(self, frame: FrameType) -> None:
        """Keep what annotations name of the class's surroundings; `frame` is that of the class statement."""

    def renewed(self, function: FunctionType) -> Declaration | None:  # noqa: ARG002  # for those that override it
        """Return the declaration of a method that overrides this one without a decorator; None if it ends there."""
        return None


class EndpointDeclaration(Declaration, Generic[E]):
    """An attribute that is this declaration on the class and an endpoint on an instance.

    The instance's own dictionary holds the endpoint, under the same name, once its node is part of a graph.
    """

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type) -> E: ...
    def __get__(self, instance: object | None, owner: type) -> Self | E:
        if instance is None:
            return self
        if self.name in vars(instance):  # only super() asks here then, and it means the timer's method
            return vars(self)["function"].__get__(instance, owner)
        raise AttributeError(NOT_ATTACHED.format(owner=owner.__name__, name=self.name))


class PublisherDeclaration(EndpointDeclaration[Publisher[M]]):
    """A class attribute made by `publisher`."""

    def __init__(self, message_type: type[M], topic: str, qos: QoS | None) -> None:
        self.type: Any = checked_type(message_type, "publisher")
        self.topic: str = checked_name(topic, f"publisher({message_type.__name__}, …)", "topic")
        self.written: tuple[str, int] | None = calling_line()
        self.qos: QoS | None = checked_qos(qos, "publisher(…)")


class PullDeclaration(EndpointDeclaration[Subscription[M]]):
    """A class attribute made by `subscription(Type, topic)`: to pull from."""

    def __init__(self, message_type: type[M], topic: str, qos: QoS | None) -> None:
        self.type: Any = checked_type(message_type, "subscription")
        self.topic: str = checked_name(topic, f"subscription({message_type.__name__}, …)", "topic")
        self.written: tuple[str, int] | None = calling_line()
        self.qos: QoS | None = checked_qos(qos, "subscription(…)")

    def __call__(self, function: Any) -> NoReturn:
        """Refuse to be a decorator.

        Raises:
            InvalidDeclaration: always; it says what to write.
        """
        name = getattr(function, "__name__", "on_message")
        raise InvalidDeclaration(
            f'above a method write @subscription("{self.topic}"): the method itself states the type, '
            f"def {name}(self, message: {self.type.__name__})"
        )


class ClientDeclaration(EndpointDeclaration[Client[Req, Res]]):
    """A class attribute made by `client`."""

    def __init__(self, service_type: type[Pair[Req, Res]], service: str) -> None:
        self.type: type[ServiceType] = checked_service_type(service_type, "client")
        self.written: tuple[str, int] | None = calling_line()
        self.service = service


class TimerDeclaration(EndpointDeclaration[Timer]):
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
        if not takes_none(function):
            name = getattr(function, "__name__", "tick")
            raise InvalidDeclaration(f"@timer calls {name} with nothing but the node: write def {name}(self)")
        self.function = function
        self.written: tuple[str, int] | None = line_of(function)
        self.missed = missed
        self._period_s = period_s
        self._hz = hz

    def renewed(self, function: FunctionType) -> TimerDeclaration:
        """Return the same timer for the method of a subclass that overrides this one."""
        return TimerDeclaration(function, self._period_s, self._hz, self.missed)

    @property
    def parameter(self) -> str | None:
        """The parameter that decides the period, or None where it is fixed."""
        given = self._period_s if self._hz is None else self._hz
        return given if isinstance(given, str) else None

    def period(self, parameters: object) -> Fraction:
        """Return the seconds between ticks under these parameters; 0 is off.

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


class ComposedDeclaration(EndpointDeclaration[E]):
    """An attribute of a package above: endpoints that a node gets together, and what stands for them on an instance."""

    def compose(self, node: Any) -> E:
        """Create the endpoints with the runtime of a node; return the instance's attribute.

        The bus is not there yet: what needs it is added to the runtime's `on_connect`.
        """
        raise NotImplementedError


class ParametersDeclaration(Declaration):
    """A class's `parameters` annotation; on an instance the same name is the node's parameters."""

    def __init__(self, annotation: Any, frame: FrameType) -> None:
        self._annotation = annotation
        self._surroundings = names_used(annotation, frame) if isinstance(annotation, str) else {}
        self.written: tuple[str, int] | None = (frame.f_code.co_filename, frame.f_lineno)

    def parameters_class(self, module: str) -> type[Parameters]:
        """Return the class that the annotation names.

        Raises:
            InvalidDeclaration: it cannot be resolved, or is no `Parameters` class.
        """
        found: Any = self._annotation
        if isinstance(found, str):
            try:
                found = resolve(found, vars(sys.modules[module]), self._surroundings, self.origin)
            except InvalidDeclaration as error:
                error.place = self.place
                raise
        if isinstance(found, type) and issubclass(cast("type[Any]", found), Parameters):
            return cast("type[Parameters]", found)
        refused = InvalidDeclaration(
            f"{self.origin} must be annotated with a class derived from busflow.Parameters, "
            f"not {printable(repr(found))}"
        )
        refused.place = self.place
        raise refused


def publisher(message_type: type[M], topic: str, qos: QoS | None = None) -> PublisherDeclaration[M]:
    """Publish a topic.

    Write `balance = publisher(Float64, "balance_state")` in the class, and `self.balance.publish(…)` in its methods.
    """
    return PublisherDeclaration(message_type, topic, qos)


def client(service_type: type[Pair[Req, Res]], service: str) -> ClientDeclaration[Req, Res]:
    """Call a service.

    Write `reset = client(Trigger, "sensor_publisher/reset")` in the class, `await self.reset.call()` in its methods.
    """
    return ClientDeclaration(service_type, service)


def timer(
    period_s: float | str | None = None, *, hz: float | str | None = None, missed: str = Missed.SKIP
) -> Callable[[Callable[[Any], Any]], TimerDeclaration]:
    """Call a method periodically: `@timer(0.1)`, `@timer(hz=10)`, or `@timer(hz="rate_hz")` naming a parameter.

    A change of the parameter changes the timer; a parameter of 0 is off. The first call comes after one period. A tick
    that could not be kept is skipped and counted, or made up for with `missed="burst"`.
    """
    if callable(period_s):
        name = getattr(period_s, "__name__", "tick")
        raise InvalidDeclaration(f"@timer needs a period: write @timer(0.1), or @timer(hz=10), above {name}")
    if (period_s is None) == (hz is None):
        raise InvalidDeclaration("@timer takes either the period in seconds or hz=, and a number or a parameter's name")
    given = hz if period_s is None else period_s
    if not isinstance(given, str) and not _is_period(given):
        raise InvalidDeclaration(f"@timer(…) needs a positive number or a parameter's name, got {given!r}")
    policy = Missed(missed)
    return lambda function: TimerDeclaration(function, period_s, hz, policy)


def _is_period(given: object) -> bool:
    return isinstance(given, int | float) and not isinstance(given, bool) and 0 < given < float("inf")


def checked_name(name: Any, what: str, kind: str) -> str:
    """Return the name of a topic, if it is a text.

    Raises:
        InvalidDeclaration: it is anything else.
    """
    if not isinstance(name, str):
        raise InvalidDeclaration(f"{what} needs the {kind}'s name, a text, not {printable(repr(name), limit=200)}")
    return name


def checked_type(message_type: Any, origin: str) -> Any:
    """Return the type, if it is one of messages.

    Raises:
        InvalidDeclaration: it is anything else.
    """
    if not (isinstance(message_type, type) and issubclass(cast("type[Any]", message_type), Message)):
        raise InvalidDeclaration(
            f"{origin} needs a message type, a class derived from busflow.Message, not {printable(message_type)!r}"
        )
    return message_type


def checked_service_type(service_type: Any, origin: str) -> type[ServiceType]:
    """Return the type, if it is one of services.

    Raises:
        InvalidDeclaration: it is anything else.
    """
    if isinstance(service_type, type) and issubclass(cast("type[Any]", service_type), ServiceType):
        return cast("type[ServiceType]", service_type)
    raise InvalidDeclaration(
        f"{origin} needs a service type, a class derived from ServiceType such as std_srvs' Trigger, and then the "
        f"service's name; not {printable(service_type)!r}"
    )
