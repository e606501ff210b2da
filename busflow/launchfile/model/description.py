"""`LaunchDescription`: the content of a launch file, resolved and typed. Data only: no plugin is imported yet."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from busflow.bus.names import resolve
from busflow.errors import IncompleteRecording, Problem
from busflow.launchfile.model.doubts import Doubt
from busflow.launchfile.model.supervision import RestartPolicy, Supervision
from busflow.launchfile.yaml.value import Origin, StatedBy, StatedPath, Value

if TYPE_CHECKING:
    from busflow.bus.qos import QoS
    from busflow.launchfile.model.network import NetworkSpec
    from busflow.launchfile.model.ros2 import Ros2Spec


class ClockMode(StrEnum):
    """Clock of a run."""

    SYSTEM = "system"
    SIM = "sim"
    FOLLOW = "follow"  # the topic /clock


class Compression(StrEnum):
    """Compression of a recording's chunks."""

    ZSTD = "zstd"
    LZ4 = "lz4"
    NONE = "none"


class OnDrop(StrEnum):
    """Consequence for the run of a message missing from its recording."""

    WARN = "warn"
    FAIL = "fail"

    def apply(self, text: str, *, warn: Callable[[str], object], fail: Callable[[IncompleteRecording], object]) -> None:
        """Warn that a recording is incomplete, or fail the run; `text` says which recording, and why."""
        if self is OnDrop.FAIL:
            fail(IncompleteRecording(f"{text} (on_drop: fail)"))
        else:
            warn(text)


@dataclass(frozen=True, slots=True)
class Split:
    """Limits of each part of a recording that is written as several files."""

    size: int | None = None
    """Bytes of a part in its file; None for no limit."""
    duration_s: float | None = None


@dataclass(frozen=True, slots=True)
class SnapshotSpec:
    """The last moments of a run that are kept in memory."""

    window_s: float
    most_bytes: int
    after_s: float = 0.0
    """The time that is written too, after the snapshot was asked for."""


@dataclass(frozen=True, slots=True)
class RecordSpec:
    """Topics to record from a run, and the file to write."""

    to: str  # `{name}` and `{start}` stand for the run's name and the time
    topics: tuple[str, ...] = ()  # patterns; empty: all but hidden topics
    exclude: tuple[str, ...] = ()
    on_drop: OnDrop = OnDrop.WARN
    compression: Compression = Compression.ZSTD
    split: Split | None = None
    snapshot: SnapshotSpec | None = None  # instead of a recording of the whole run


@dataclass(frozen=True, slots=True)
class EndpointSpec:
    """QoS that a launch file states for one endpoint of a node, or for a topic."""

    topic: str  # as written; in a TopicSpec the absolute name
    qos: QoS  # holds only the stated fields: see `model_fields_set`
    stated: Value  # a mapping of QoS fields, or the name of a profile
    origin: Origin  # its `place` is the topic's key

    def full_topic(self, node: str, namespace: str) -> str:
        """Return the topic's absolute name, resolved for a node of this name and namespace."""
        return resolve(self.topic, node=node, namespace=namespace, remaps={}).name


@dataclass(frozen=True, slots=True)
class TopicSpec(EndpointSpec):
    """Contract of a topic, by its final name."""

    type: str | None = None  # "sensor_msgs/msg/Imu"
    history: int | None = None  # how many messages are kept for `topic echo --last`
    external: bool = False  # whether its other end is outside of the run on purpose


@dataclass(frozen=True, slots=True)
class RemapSpec:
    """One entry of a node's `remap`."""

    match: str
    replacement: str
    origin: Origin  # its `place` is the rule's key


@dataclass(frozen=True, slots=True)
class NodeSpec:
    """One node to run: its plugin, its name, and all settings from the files and the command line."""

    name: str
    namespace: str  # absolute: "/" or "/left"
    origin: Origin  # its `place` is the node's key
    plugin: str
    plugin_origin: Origin
    parameters: Value  # a mapping, not validated yet: validate its `.data`
    folders: tuple[Path, ...] = ()  # plugin folders, those of the node's own file first
    remap: tuple[RemapSpec, ...] = ()
    publishers: tuple[EndpointSpec, ...] = ()
    subscriptions: tuple[EndpointSpec, ...] = ()
    supervision: Supervision = field(default_factory=Supervision)
    depends_origins: Mapping[str, Origin] = field(default_factory=dict[str, Origin])  # by the other node's full name
    process: str | None = None  # None: the main process, that of `busflow run` itself
    machine: str | None = None  # None: the main machine

    @property
    def folder(self) -> Path:
        """The folder of the file that names its plugin; the working directory if no file does."""
        place = self.plugin_origin.place if self.plugin_origin.source is StatedBy.FILE else None
        return Path(place.file).parent if place is not None else Path()

    @property
    def full_name(self) -> str:
        """The node's name with its namespace: `/left/camera`."""
        return f"{self.namespace.rstrip('/')}/{self.name}"


HANG_S = 30.0
"""How long the event loop of a process may stand still, unless the launch file says: a model takes long to load."""


@dataclass(frozen=True, slots=True)
class ProcessSpec:
    """Worker process of the run."""

    name: str
    origin: Origin  # its `place` is the process's key
    machine: str | None = None  # None: the main machine
    nice: int = 0
    env: Mapping[str, str] = field(default_factory=dict[str, str])
    restart: RestartPolicy = field(default_factory=RestartPolicy)
    hang_s: float = HANG_S  # infinite: its event loop may stand still for ever


GRACE_S = 2.0
"""How long a program may take to end after SIGINT, and again after SIGTERM, unless the launch file says."""


@dataclass(frozen=True, slots=True)
class ProgramSpec:
    """Program of any language that runs beside the nodes."""

    name: str  # its full name: "/driver" or "/left/driver"
    origin: Origin  # its `place` is the program's key
    command: tuple[str, ...]  # the program and its arguments
    command_origin: Origin
    cwd: Path
    cwd_origin: Origin
    env: Mapping[str, str] = field(default_factory=dict[str, str])
    ready: str | None = None  # a text in a line of its output that says that it is ready
    grace_s: float = GRACE_S
    supervision: Supervision = field(default_factory=Supervision)
    depends_origins: Mapping[str, Origin] = field(default_factory=dict[str, Origin])  # by the other's full name
    machine: str | None = None  # None: the main machine


@dataclass(frozen=True, slots=True)
class ClockSpec:
    """Clock that a launch file selects."""

    mode: ClockMode = ClockMode.SYSTEM
    start_s: float | None = None  # sim only: start time, in seconds since the epoch
    rate: float | None = None  # sim only: simulated seconds per real second; None: unbounded


@dataclass(frozen=True, slots=True)
class LaunchDescription:
    """Graph to run, described by one launch file with its includes, its arguments and the command line."""

    name: str
    nodes: tuple[NodeSpec, ...]
    topics: tuple[TopicSpec, ...] = ()
    folders: tuple[StatedPath, ...] = ()  # plugin folders
    interfaces: tuple[StatedPath, ...] = ()  # folders of definition files
    packages: Mapping[str, Path] = field(default_factory=dict[str, Path])  # folders that package:// addresses begin at
    processes: tuple[ProcessSpec, ...] = ()
    programs: tuple[ProgramSpec, ...] = ()
    network: NetworkSpec | None = None  # None if everything is on one machine
    ros2: Ros2Spec | None = None  # None: no node of ROS 2 takes part
    line: bool = True  # whether processes of a machine send each other messages directly
    here: str | None = None  # this machine; None: the whole graph is checked or run as one
    clock: ClockSpec = ClockSpec()
    seed: int | None = None
    record: RecordSpec | None = None
    expect: Value | None = None  # an `ExpectKeys` mapping, for `busflow test`
    shutdown_grace_s: float | None = None
    environment: Mapping[str, str] = field(default_factory=dict[str, str])  # variables that the files state
    warnings: tuple[Problem, ...] = ()  # not wrong, but probably not intended
    doubts: frozenset[Doubt] = frozenset()  # facts unknown because of mistakes; empty without mistakes
    files: tuple[Path, ...] = ()  # every file that was read, the launch file first
    resolved: Value | None = None  # the whole as one file, for `busflow config`

    @property
    def file(self) -> str:
        """The absolute path of the launch file; empty where the command line states the only node."""
        return str(self.files[0].absolute()) if self.files else ""


Examined: TypeAlias = tuple[LaunchDescription | None, tuple[Problem, ...]]
"""The valid part of a launch file, and all problems."""
