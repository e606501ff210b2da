"""Node: the class that plugins subclass. Sixteen public names and one private one, so that nothing collides."""

from __future__ import annotations

import re
from collections.abc import Callable, Coroutine
from inspect import getattr_static, iscoroutinefunction, isfunction
from typing import Any, Never, TypeVar, TypeVarTuple, Unpack, cast, overload

import anyio.to_thread

from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.bus.services.call import Pair, Req, Res
from busflow.bus.services.client import Client
from busflow.bus.services.server import DEPTH, RequestHandler, Server
from busflow.bus.subscription import MessageHandler, Subscription
from busflow.bus.timer import Missed, Timer, TimerHandler, exact_period
from busflow.clock import Clock
from busflow.errors import InvalidDeclaration
from busflow.interfaces.message import Message
from busflow.log import Logger
from busflow.node.context import Rng
from busflow.node.declarations import ParametersDeclaration
from busflow.node.handlers import inherit
from busflow.node.parameters import Parameters, validate
from busflow.node.runtime import NodeRuntime
from busflow.node.signatures import calling_frame, calling_line
from busflow.text import printable
from busflow.validation.as_written import written_annotations
from busflow.validation.tracebacks import line

M = TypeVar("M", bound=Message)
T = TypeVar("T")
Ts = TypeVarTuple("Ts")

_HOOKS = frozenset({"declare", "start", "run", "stop"})
NO_INIT = "write no __init__: its ends are declared in the class, or in declare(), and start() sets up the rest"
"""The advice for a node class with an `__init__` of its own."""


_RCLPY = {
    "add_on_set_parameters_callback": "a validator of the Parameters class",
    "add_post_set_parameters_callback": "@on_parameters above def retune(self, old)",
    "create_guard_condition": "an asyncio.Event",
    "create_rate": "a timer, or await self.clock.sleep(0.1) in async def run(self)",
    "declare_parameter": "a field of the Parameters class, with Field(default=1.0, ge=0, description=…)",
    "declare_parameters": "a field of the Parameters class, with Field(default=1.0, ge=0, description=…)",
    "destroy_node": "async def stop(self)",
    "get_clock": "self.clock.now()",
    "get_logger": 'self.log.info("text", x=x)',
    "get_name": "self.name",
    "get_parameter": "self.parameters.a",
    "get_parameters": "self.parameters.a",
    "set_parameters": 'graph.set_parameters("node", {"noise.imu": 0.5})',
}
"""Names that a node has in rclpy and not here, and what to write instead, in the words of docs/coming-from-rclpy.md."""


class _RclpyName:
    """Raises AttributeError for a name of rclpy's, and says what to write instead.

    It stands in the class because a `__getattr__` would cost each attribute of a node some 80 ns on Python 3.11.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, instance: object, owner: type) -> Never:
        raise AttributeError(f"{owner.__name__} has no {self._name}, which is rclpy's; here it is {_RCLPY[self._name]}")


class _Unmade:
    """Raises AttributeError where an `__init__` uses what Node's own has not made yet."""

    def __get__(self, instance: object, owner: type) -> Never:
        name = owner.__name__
        raise AttributeError(f"{name}.__init__ must call super().__init__() before it uses the node; better, {NO_INIT}")


class _RclpyNames:
    """A class with rclpy's names, and what a node has only once it is made; of which a node is one."""


for _name in ("_runtime", *_RCLPY):  # one by one, so that type checkers do not take them for attributes
    setattr(_RclpyNames, _name, _RclpyName(_name) if _name in _RCLPY else _Unmade())


class Node(_RclpyNames):
    """A unit of a robot's software: declares what it publishes and receives, and reacts.

    Subclass it, annotate `parameters` with your own `Parameters` class if there are any, declare endpoints with
    `publisher`, `@subscription` and `@timer`, and keep state in `start`: a restart builds a new instance.

    Made by hand, a node takes its parameters: `SensorPublisher(rate_hz=50)`, or
    `SensorPublisher(SensorPublisherParameters(rate_hz=50), name="left")`. Its name is otherwise its class's, in
    snake case.
    """

    parameters: Any
    """The node's parameters: frozen, replaced as a whole when they change."""

    _runtime: NodeRuntime

    def __init__(self, parameters: Parameters | None = None, /, *, name: str | None = None, **values: Any) -> None:
        """Create a node that is not part of a graph yet.

        Raises:
            InvalidParameter: a parameter is unknown, of the wrong type or out of range.
        """
        expected = parameters_class(type(self))
        if parameters is None:
            parameters = validate(expected, values)
        elif isinstance(parameters, str):
            kind, name = type(self).__name__, printable(repr(parameters), limit=100)
            named = (
                f"{kind} is named by the launch file, by its class or with {kind}(name={name}), not with {name} alone"
            )
            raise InvalidDeclaration(named if type(self).__init__ is Node.__init__ else f"{named}; {NO_INIT}")
        elif values or not isinstance(parameters, expected):
            raise InvalidDeclaration(
                f"{type(self).__name__} takes either one {expected.__name__} or its values by name"
            )
        self.parameters = parameters
        self._runtime = NodeRuntime(self, default_name(type(self)) if name is None else name)

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Check the class's names against Node's own, and settle what it declares."""
        super().__init_subclass__(**kwargs)
        frame = calling_frame()
        annotations = written_annotations(cls)
        for name in {*vars(cls), *annotations} & _RESERVED:
            if name == "parameters" and name not in vars(cls):
                declared = ParametersDeclaration(annotations[name], frame)
                declared.__set_name__(cls, name)
                cls.parameters = declared
                continue
            if name == "parameters":
                wanted = f"{cls.__name__}Parameters"
                raise InvalidDeclaration(
                    f"{cls.__name__}.parameters is an annotation, not a value: write parameters: {wanted} in the "
                    f"class, and above it class {wanted}(Parameters): …"
                )
            raise InvalidDeclaration(f"{cls.__name__}.{name} hides Node.{name}; choose another name")
        for name in _HOOKS & vars(cls).keys():
            kind = "def" if name == "declare" else "async def"
            hook = vars(cls)[name]
            if isfunction(hook) and iscoroutinefunction(hook) == (name == "declare"):
                error = InvalidDeclaration(f"{cls.__name__}.{name} must be written as {kind} {name}(self)")
                error.place = line(hook.__code__.co_filename, hook.__code__.co_firstlineno)
                raise error
        inherit(cls, frame)

    # What there is around a node.

    @property
    def name(self) -> str:
        """The node's name, without its namespace."""
        return self._runtime.name

    @property
    def clock(self) -> Clock:
        """The run's clock: `now()` for stamps, `seconds()` since the run began, `await sleep(s)`."""
        return self._runtime.clock

    @property
    def log(self) -> Logger:
        """The run's log, bound to this node: `self.log.warning("joint out of range", joint=name)`."""
        return self._runtime.log

    @property
    def rng(self) -> Rng:
        """A numpy random generator of this node's own, seeded by the run's seed and the node's name."""
        return self._runtime.rng

    def spawn(self, coroutine: Coroutine[Any, Any, None], *, name: str | None = None) -> None:
        """Run a coroutine beside the node until it ends or the node stops; if it raises, the node fails."""
        if not isinstance(cast("object", coroutine), Coroutine):
            raise InvalidDeclaration(f"self.spawn(self.work()) takes the call of an async def, not {coroutine!r}")
        self._runtime.life.spawn(coroutine, name or coroutine.__name__)

    async def run_sync(self, function: Callable[[Unpack[Ts]], T], *args: *Ts) -> T:
        """Call a blocking function in a worker thread; when the node stops, the call is no longer waited for."""
        if iscoroutinefunction(function):
            name = getattr(function, "__name__", "…")  # functools.partial has none
            raise InvalidDeclaration(f"self.run_sync takes a plain function: write await self.{name}()")
        return await anyio.to_thread.run_sync(function, *args, abandon_on_cancel=True)

    # What a subclass may define.

    def declare(self) -> None:
        """Create the endpoints that depend on parameters; runs before anything starts and does no I/O."""

    async def start(self) -> None:
        """Open what the node needs; messages wait until this returns."""

    async def run(self) -> None:
        """Run the node's own loop, beside handlers and timers; it may return, and is cancelled when the node stops."""

    async def stop(self) -> None:
        """Close what `start` opened; called also when `start` failed half-way."""

    # Endpoints without a declaration in the class.

    def create_publisher(self, message_type: type[M], topic: str, qos: QoS | None = None) -> Publisher[M]:
        """Publish a topic from now on.

        Raises:
            InvalidName, IncompatibleType, IncompatibleQoS: at once, when the node is part of a graph.
        """
        origin = f"{self.name}: create_publisher"
        return self._runtime.create_publisher(message_type, topic, qos, origin=origin, line=calling_line())

    def create_subscription(
        self, message_type: type[M], topic: str, handler: MessageHandler[M] | None = None, qos: QoS | None = None
    ) -> Subscription[M]:
        """Receive a topic from now on, with a handler or, without one, to pull from.

        Raises:
            InvalidName, IncompatibleType, IncompatibleQoS: at once, when the node is part of a graph.
        """
        origin = f"{self.name}: create_subscription"
        written = calling_line()
        return self._runtime.create_subscription(message_type, topic, handler, qos, origin=origin, line=written)

    def create_service(
        self,
        service_type: type[Pair[Req, Res]],
        service: str,
        handler: RequestHandler[Req, Res],
        *,
        depth: int = DEPTH,
    ) -> Server[Req, Res]:
        """Answer a service from now on; at most `depth` requests wait.

        Raises:
            InvalidName, IncompatibleType, DuplicateServer: at once, when the node is part of a graph.
        """
        origin = f"{self.name}: create_service"
        written = calling_line()
        return self._runtime.create_service(service_type, service, handler, depth=depth, origin=origin, line=written)

    def create_client(self, service_type: type[Pair[Req, Res]], service: str) -> Client[Req, Res]:
        """Call a service from now on.

        Raises:
            InvalidName, IncompatibleType: at once, when the node is part of a graph.
        """
        origin = f"{self.name}: create_client"
        return self._runtime.create_client(service_type, service, origin=origin, line=calling_line())

    @overload
    def create_timer(
        self, period_s: float, handler: TimerHandler, *, name: str | None = None, missed: str = Missed.SKIP
    ) -> Timer: ...
    @overload
    def create_timer(
        self, *, hz: float, handler: TimerHandler, name: str | None = None, missed: str = Missed.SKIP
    ) -> Timer: ...
    def create_timer(
        self,
        period_s: float | None = None,
        handler: TimerHandler | None = None,
        *,
        hz: float | None = None,
        name: str | None = None,
        missed: str = Missed.SKIP,
    ) -> Timer:
        """Call a handler periodically from now on: `create_timer(0.1, self.tick)`, or `hz=10, handler=self.tick`.

        0 is off.
        """
        if handler is None:
            raise InvalidDeclaration("create_timer needs a handler: create_timer(0.1, self.tick)")
        shown = name or getattr(handler, "__name__", "timer")
        period = exact_period(period_s, hz, shown)
        return self._runtime.create_timer(period, handler, name=shown, missed=Missed(missed))

    def __dir__(self) -> list[str]:
        absent = {name for name in _RCLPY if isinstance(getattr_static(self, name), _RclpyName)}
        return [name for name in super().__dir__() if name not in absent]

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self._runtime.full_name}>"


_RESERVED = frozenset(
    name for name in {*vars(Node), *Node.__annotations__} if not name.startswith("__") and name not in _HOOKS
)


def default_name(node_class: type) -> str:
    """Return the name of a node that was given none.

    >>> default_name(type("IMUPublisher2", (), {}))
    'imu_publisher2'
    """
    words = re.sub(r"([A-Z]+)([A-Z][a-z])", r"\1_\2", node_class.__name__)
    return re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", words).lower()


def parameters_class(node_class: type[Node]) -> type[Parameters]:
    """Return the class of a node's parameters: what its `parameters` annotation names.

    Raises:
        InvalidDeclaration: the annotation cannot be resolved, or is no `Parameters` class.
    """
    for owner in node_class.__mro__:
        declared = vars(owner).get("parameters")
        if isinstance(declared, ParametersDeclaration):
            return declared.parameters_class(owner.__module__)
    return Parameters


def runtime_of(node: Node) -> NodeRuntime:
    """Return the runtime behind a node's private name, for the code that runs nodes.

    Raises:
        InvalidDeclaration: the node's class has an `__init__` that leaves Node's own out.
    """
    runtime = vars(node).get("_runtime")
    if runtime is None:
        kind = type(node).__name__
        raise InvalidDeclaration(f"{kind}.__init__ must call super().__init__(); better, {NO_INIT}")
    return runtime
