"""`LaunchDescription`: what a launch file says, resolved and typed; data only, no plugin is imported yet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

from busflow.bus.names import resolve
from busflow.launchfile.model.doubts import Doubt
from busflow.launchfile.yaml.value import Origin, Value
from busflow.node.supervision import RestartPolicy, Supervision

if TYPE_CHECKING:
    from busflow.bus.qos import QoS
    from busflow.errors import Problem
    from busflow.launchfile.model.network import NetworkSpec


class ClockMode(StrEnum):
    """Which time a run lives in."""

    SYSTEM = "system"
    SIM = "sim"
    FOLLOW = "follow"  # the topic /clock


class Compression(StrEnum):
    """How the chunks of a recording are compressed."""

    ZSTD = "zstd"
    LZ4 = "lz4"
    NONE = "none"


class OnDrop(StrEnum):
    """What it means for the run that its recording lacks a message."""

    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True, slots=True)
class RecordSpec:
    """What is to be recorded of a run, and where."""

    to: str  # `{name}` and `{start}` stand for the run's name and the time
    topics: tuple[str, ...] = ()  # patterns; none is all but hidden ones
    exclude: tuple[str, ...] = ()
    on_drop: OnDrop = OnDrop.WARN
    compression: Compression = Compression.ZSTD


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument of a launch file, and its value in this description."""

    name: str
    type: str  # "float", "int", "bool", "str" or "list[…]" of these
    value: Value
    required: bool = False
    default: object = None
    help: str = ""
    choices: tuple[object, ...] | None = None
    minimum: float | None = None
    maximum: float | None = None


@dataclass(frozen=True, slots=True)
class PluginFolder:
    """A folder in which plugins are looked up."""

    path: Path
    origin: Origin


@dataclass(frozen=True, slots=True)
class EndpointSpec:
    """The QoS a launch file states for one endpoint of a node, or for a topic."""

    topic: str  # as written; of a TopicSpec the absolute name
    qos: QoS  # holds only what was stated: see `model_fields_set`
    stated: Value  # a mapping of QoS fields, or the name of a profile
    origin: Origin  # its `place` is the topic's key

    def full_topic(self, node: str, namespace: str) -> str:
        """The topic by its absolute name, as a node of this name and namespace means it."""
        return resolve(self.topic, node=node, namespace=namespace, remaps={}).name


@dataclass(frozen=True, slots=True)
class TopicSpec(EndpointSpec):
    """The contract of a topic, by its final name."""

    type: str | None = None  # "sensor_msgs/msg/Imu"
    history: int | None = None  # how many messages are kept for those who look later


@dataclass(frozen=True, slots=True)
class RemapSpec:
    """One entry of a node's `remap`."""

    match: str
    replacement: str
    origin: Origin  # its `place` is the rule's key


@dataclass(frozen=True, slots=True)
class NodeSpec:
    """One node to run: its plugin, name, and everything the files and the command line say about it."""

    name: str
    namespace: str  # absolute: "/" or "/left"
    origin: Origin  # its `place` is the node's key
    plugin: str
    plugin_origin: Origin
    parameters: Value  # a mapping, not validated yet: `.data` is what to validate
    folders: tuple[Path, ...] = ()  # plugin folders, those of the node's own file first
    remap: tuple[RemapSpec, ...] = ()
    publishers: tuple[EndpointSpec, ...] = ()
    subscriptions: tuple[EndpointSpec, ...] = ()
    supervision: Supervision = field(default_factory=Supervision)
    depends_origins: Mapping[str, Origin] = field(default_factory=dict[str, Origin])  # by the other's full name
    process: str | None = None  # where it runs; None is the process of `busflow run` itself
    machine: str | None = None  # and on which machine; None is the main one

    @property
    def full_name(self) -> str:
        """The node's name with its namespace: `/left/camera`."""
        return f"{self.namespace.rstrip('/')}/{self.name}"


@dataclass(frozen=True, slots=True)
class ProcessSpec:
    """A process of the run beside its main one."""

    name: str
    origin: Origin  # its `place` is the process's key
    machine: str | None = None  # None is the main one
    nice: int = 0
    env: Mapping[str, str] = field(default_factory=dict[str, str])
    restart: RestartPolicy = field(default_factory=RestartPolicy)


@dataclass(frozen=True, slots=True)
class ClockSpec:
    """The clock a launch file asks for."""

    mode: ClockMode = ClockMode.SYSTEM
    start_s: float | None = None  # sim only: the epoch the clock starts at
    rate: float | None = None  # sim only: its seconds per second of the wall; None is unbounded


@dataclass(frozen=True, slots=True)
class LaunchDescription:
    """A graph to run, from one launch file with its includes, its arguments and the command line."""

    name: str
    nodes: tuple[NodeSpec, ...]
    topics: tuple[TopicSpec, ...] = ()
    profiles: Mapping[str, QoS] = field(default_factory=dict[str, "QoS"])
    arguments: tuple[Argument, ...] = ()
    folders: tuple[PluginFolder, ...] = ()
    processes: tuple[ProcessSpec, ...] = ()
    network: NetworkSpec | None = None  # None where everything is on one machine
    here: str | None = None  # the machine that this is; None where all of the graph is looked at as one
    clock: ClockSpec = ClockSpec()
    seed: int | None = None
    record: RecordSpec | None = None
    expect: Value | None = None  # an `ExpectKeys` mapping, for `busflow test`
    shutdown_grace_s: float | None = None
    environment: Mapping[str, str] = field(default_factory=dict[str, str])  # variables that the files state
    warnings: tuple[Problem, ...] = ()  # what is not wrong, but probably not meant
    doubts: frozenset[Doubt] = frozenset()  # what its mistakes leave open; without one, nothing
    files: tuple[Path, ...] = ()  # every file that was read, the launch file first
    resolved: Value | None = None  # the whole as one file, for `busflow config`
