"""Keys of a launch file: their types, defaults and help. The checks and the JSON Schema are made from them."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self, cast

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from busflow.bus.patterns import check_pattern
from busflow.launchfile.model.description import GRACE_S, HANG_S, ClockMode, Compression, OnDrop
from busflow.launchfile.model.network import Role
from busflow.launchfile.model.ros2 import MOST_DOMAIN, Ros2Transport
from busflow.launchfile.model.section import Bytes, Repeatable, RestartKeys, RestartValue, Seconds, Section
from busflow.launchfile.model.supervision import Condition, OnExit, Restart
from busflow.validation.versions import check_requirement

Qos = str | dict[str, Any]
"""Name of a profile, or fields of one. `busflow.bus.qos` checks them."""


def _variable(name: str) -> str:
    if not name or "=" in name or "\0" in name:
        raise ValueError("the name of a variable is not empty, and has no '='")
    return name


def _text(value: str) -> str:
    if "\0" in value:
        raise ValueError("the value of a variable has no NUL byte")
    return value


_Text = Annotated[str, AfterValidator(_text)]
Environment = dict[Annotated[str, AfterValidator(_variable)], _Text | int | float | bool]
"""What an environment can hold."""


class ArgumentKeys(Section):
    """One argument of the launch file, given as `name:=value`."""

    type: Literal["float", "int", "bool", "str", "list[float]", "list[int]", "list[bool]", "list[str]"] = Field(
        description="What a value must be."
    )
    default: Any = Field(default=None, description="The value where none is given; without it one must be given.")
    help: str = Field(default="", description="What `busflow run FILE --help` says about it.")
    choices: list[Any] | None = Field(default=None, min_length=1, description="The only values allowed.")
    min: float | None = Field(default=None, description="The smallest value allowed.")
    max: float | None = Field(default=None, description="The largest value allowed.")

    @model_validator(mode="after")
    def _ranges_are_for_numbers(self) -> Self:
        if (self.min is not None or self.max is not None) and not {"float", "int"} & {self.type, self.type[5:-1]}:
            raise ValueError(f"min and max are for numbers, not for {self.type}")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError("min must not be above max")
        return self


class TopicKeys(Repeatable):
    """The contract of a topic, by its final name."""

    later: ClassVar[Mapping[str, str]] = {"expect": "write it at the top level, under expect: topics:"}

    type: str | None = Field(default=None, description="The message type: sensor_msgs/msg/Imu.")
    qos: Qos | None = Field(default=None, description="A profile's name, or fields of one.")
    history: int | None = Field(
        default=None, ge=0, le=100_000, description="How many messages are kept for `topic echo --last`; 1 unless said."
    )
    external: bool = Field(
        default=False, description="Whether its other end is outside of the run on purpose: a viewer, a tool, ROS 2."
    )


class DefaultKeys(Section):
    """Defaults for the nodes of a file or a group."""

    parameters: dict[str, Any] = Field(default_factory=dict, description="The node's parameters.")
    remap: dict[str, str] = Field(default_factory=dict, description="Topics renamed for this node: `imu: /imu/data`.")
    publishers: dict[str, Qos] = Field(default_factory=dict, description="QoS of what the node publishes, by topic.")
    subscriptions: dict[str, Qos] = Field(default_factory=dict, description="QoS of what it receives, by topic.")
    restart: RestartValue = Field(
        default=RestartKeys(policy=Restart.NEVER), description="What happens when the node fails or ends."
    )
    depends_on: dict[str, Condition] = Field(
        default_factory=dict,
        description="What to wait for in other nodes and programs before the start, by their names.",
    )
    on_exit: OnExit = Field(default=OnExit.IGNORE, description="What the end of the node's run() means for the others.")
    process: str | None = Field(
        default=None, min_length=1, description="The process it runs in, one of `processes`; main unless said."
    )
    machine: str | None = Field(
        default=None, min_length=1, description="The machine it runs on, one of `machines`; that of its process."
    )


class NodeKeys(Repeatable, DefaultKeys):
    """One node to run."""

    later: ClassVar[Mapping[str, str]] = {
        "log": "leave it out",
    }

    plugin: str | None = Field(
        default=None,
        min_length=1,
        description="The node's class: an installed name, a file or folder in `plugins`, or `name:Class`. "
        "Left out, the entry changes a node of an included file.",
    )
    namespace: str | None = Field(default=None, description="Put before the node's name and its relative topics.")
    parameters_from: str | list[str] = Field(
        default_factory=list[str], description="YAML files with parameters, under those stated here."
    )


class IncludeKeys(Repeatable):
    """Another launch file whose nodes run too."""

    file: str = Field(min_length=1, description="The file, relative to this one.")
    args: dict[str, Any] = Field(default_factory=dict, description="Values for the file's arguments.")
    namespace: str | None = Field(default=None, description="Put before its nodes and relative topics.")
    profile: str | None = Field(default=None, description="The profile of the file to use.")


def _include_list(data: object) -> object:
    """`include: a.yaml` and `include: [a.yaml]` are short for a list with one `file:`."""
    if isinstance(data, str):
        return [{"file": data}]
    if isinstance(data, list):
        items = cast("list[object]", data)
        return [{"file": each} if isinstance(each, str) else each for each in items]
    return data


class ProcessKeys(Section):
    """A process of the run beside its main one."""

    machine: str | None = Field(
        default=None, min_length=1, description="The machine it runs on, one of `machines`; main unless said."
    )
    nice: int = Field(default=0, ge=-20, le=19, description="Its nice value: higher leaves more CPU time to others.")
    env: Environment = Field(default_factory=dict, description="Variables of its environment, beside those of the run.")
    restart: RestartValue = Field(
        default=RestartKeys(policy=Restart.NEVER), description="What happens when the process fails, hangs or ends."
    )
    hang: Seconds = Field(default=HANG_S, description="How long its event loop may stand still; .inf for ever.")


class ProgramKeys(Repeatable):
    """A program of any language that runs beside the nodes."""

    command: Annotated[list[str | int | float | bool], Field(min_length=1)] | None = Field(
        default=None,
        description="The program and its arguments, a word each: [ros2, run, cam, node]; no shell reads it.",
    )
    cwd: str | None = Field(
        default=None,
        min_length=1,
        description="The folder it runs in, relative to this file; without it that of this file.",
    )
    env: Environment = Field(default_factory=dict, description="Variables of its environment, beside those of the run.")
    ready: str | None = Field(
        default=None, min_length=1, description="A text in a line that it prints once it is ready, for `depends_on`."
    )
    grace: Seconds = Field(
        default=GRACE_S,
        description="How long it may take to end after SIGINT, and again after SIGTERM, before SIGKILL.",
    )
    restart: RestartValue = Field(
        default=RestartKeys(policy=Restart.NEVER), description="What happens when the program fails or ends."
    )
    depends_on: dict[str, Condition] = Field(
        default_factory=dict,
        description="What to wait for in nodes and other programs before the start, by their names.",
    )
    on_exit: OnExit = Field(default=OnExit.IGNORE, description="What its end without a failure means for the others.")
    machine: str | None = Field(
        default=None, min_length=1, description="The machine it runs on, one of `machines`; main unless said."
    )


class MachineKeys(Section):
    """A machine of the run beside the main one: `busflow run FILE --machine NAME` runs what is placed on it."""

    connect: str | None = Field(default=None, description="Where the others reach it: tls/192.0.2.7:7447.")
    listen: str | None = Field(default=None, description="Where it listens; else as `network` says, or at `connect`.")
    cert: str | None = Field(default=None, description="Its certificate; else NAME.pem beside the network's `ca`.")
    key: str | None = Field(default=None, description="Its private key; else NAME.key beside the network's `ca`.")


Pattern = Annotated[str, AfterValidator(check_pattern)]
"""A pattern of topic names."""


class Ros2Keys(Section):
    """How nodes of ROS 2 on this machine reach the run. `ros2: {}` takes the defaults."""

    domain: int | None = Field(
        default=None, ge=0, le=MOST_DOMAIN, description="The domain that is joined; else that of ROS_DOMAIN_ID, else 0."
    )
    transport: Ros2Transport = Field(
        default=Ros2Transport.ZENOH, description="ROS 2's middleware: rmw_zenoh's, or dds."
    )
    router: str = Field(
        default="tcp/127.0.0.1:7447", description="Where its router is; the run stands in for one that is not there."
    )
    interface: str | None = Field(
        default=None, description="The network interface, over dds, such as eth0; else this machine alone."
    )
    topics: list[Pattern] = Field(
        default_factory=list[str], description="Only these topics and services pass, by pattern: /imu/*, /arm/**."
    )


class NetworkKeys(Section):
    """How machines trust each other, and which others may join the run. Paths are relative to the file."""

    listen: str | None = Field(default=None, description="Where each machine listens: tls/0.0.0.0:7447.")
    ca: str | None = Field(default=None, description="The certificate that has signed all others.")
    cert: str | None = Field(default=None, description="This machine's certificate; else NAME.pem beside `ca`.")
    key: str | None = Field(default=None, description="This machine's private key; else NAME.key beside `ca`.")
    allow: dict[str, Role] = Field(
        default_factory=dict[str, Role], description="What others may do, by the name in their certificate."
    )
    ros2: Ros2Keys | None = Field(default=None, description="Lets nodes of ROS 2 on this machine take part.")
    line: bool = Field(default=True, description="Whether processes of a machine send each other messages directly.")


class FrameKeys(Section):
    """A frame that never moves, seen from its parent."""

    xyz: list[float] = Field(default=[0.0, 0.0, 0.0], description="Its origin, in metres.")
    rpy: list[float] | None = Field(default=None, description="Its roll, pitch and yaw about fixed axes, in radians.")
    quaternion: list[float] | None = Field(default=None, description="Its rotation as x, y, z, w, in place of rpy.")


class ClockKeys(Section):
    """The clock of the run."""

    mode: ClockMode = Field(
        default=ClockMode.SYSTEM, description="The system's clock, a simulated one, or that of the topic /clock."
    )
    start: float | None = Field(default=None, ge=0, description="Where a simulated clock starts, in seconds.")
    seed: int | None = Field(default=None, ge=0, description="The same as `seed` at the top level.")
    rate: float | None = Field(
        default=None, gt=0, description="Simulated seconds per real second; without it as fast as possible."
    )

    @model_validator(mode="after")
    def _only_simulated(self) -> Self:
        if self.mode is not ClockMode.SIM and not (self.start is None and self.rate is None):
            raise ValueError("start and rate are for a simulated clock; write mode: sim")
        return self


class ShutdownKeys(Section):
    """How a run ends."""

    grace: Seconds | None = Field(default=None, description="How long the nodes may take to stop.")


def _ordered(limits: list[float]) -> list[float]:
    if not limits[0] <= limits[1]:
        raise ValueError("the lower limit comes first, and both are numbers")
    return limits


ORDERED = AfterValidator(_ordered)
"""The mark of limits among a key's metadata."""
Limits = Annotated[list[float], Field(min_length=2, max_length=2), ORDERED]
"""The lowest and the highest value allowed: `[9.5, 10.5]`; `-.inf` and `.inf` leave a side open."""


class TopicExpectationKeys(Section):
    """Expectations for one topic."""

    rate_hz: Limits | None = Field(default=None, description="How often it is published, on average: [9.5, 10.5].")
    max_age: Seconds | None = Field(
        default=None, description="How long after its header's stamp a message may reach a node."
    )
    max_dropped: int | None = Field(default=None, ge=0, description="How many of its messages may be dropped.")
    values: dict[str, Limits] = Field(
        default_factory=dict[str, Limits], description="Limits of fields: `linear_acceleration.z: [9, 11]`."
    )


class ExpectKeys(Section):
    """Expectations that `busflow test` checks, on simulated time."""

    duration: Seconds | None = Field(default=None, description="How long to run, unless `--for` says.")
    no_errors: bool = Field(default=False, description="No line of the log may be an error.")
    max_dropped: int | None = Field(default=None, ge=0, description="How many messages may be dropped in all.")
    topics: dict[str, TopicExpectationKeys] = Field(
        default_factory=dict[str, TopicExpectationKeys], description="What has to hold on topics, by final name."
    )


MOST_KEPT = 64 << 20
"""The bytes of a snapshot where the launch file does not say them."""


class SplitKeys(Section):
    """When a recording goes on in another file; whichever limit comes first."""

    size: Annotated[Bytes, Field(ge=1024)] | None = Field(default=None, description="The size of a part: 1GiB, 500MB.")
    duration: Seconds | None = Field(default=None, description="The time of the messages in a part: 10min.")

    @model_validator(mode="after")
    def _says_when(self) -> Self:
        if self.size is None and self.duration is None:
            raise ValueError("a part ends at a size, a duration or both: split: {size: 1GiB, duration: 10min}")
        return self


class RecordKeys(Section):
    """Topics that `busflow run` records, and the file. `record: run.mcap` alone records all topics but hidden ones."""

    to: str = Field(
        default="{name}-{start}.mcap",
        min_length=1,
        description="The file, below the working directory: runs/{name}-{start}.mcap with run and time.",
    )
    topics: list[Pattern] = Field(
        default_factory=list[str], description="Only these topics and services, by pattern: /imu/*, /arm/**."
    )
    exclude: list[Pattern] = Field(default_factory=list[str], description="Not these, by pattern.")
    on_drop: OnDrop = Field(
        default=OnDrop.WARN, description="What follows if something is missing: a warning, or the end of the run."
    )
    compression: Compression = Field(default=Compression.ZSTD, description="How the file is made smaller.")
    split: SplitKeys | None = Field(default=None, description="Writes a folder of several files, one after the other.")
    snapshot: Seconds | None = Field(
        default=None, description="Keeps only so much in memory, and writes it on `bag snapshot` or a failure: 60s."
    )
    bytes: Bytes = Field(default=MOST_KEPT, ge=1024, description="The most memory that `snapshot` takes: 64MiB.")
    after: Seconds | None = Field(default=None, description="The time after it that a snapshot also holds: 5s.")

    @model_validator(mode="after")
    def _snapshots_are_whole(self) -> Self:
        if self.snapshot is not None and self.split is not None:
            raise ValueError("split is for a whole run, and snapshot for its last moments: leave one of them out")
        if self.snapshot is None and "to" not in self.model_fields_set:
            raise ValueError("a recording needs a file: add `to: run.mcap`, or `snapshot: 60s` for the last moments")
        if self.snapshot is None and self.after is not None:
            raise ValueError("after: belongs to snapshot: how much to keep, such as snapshot: 60s")
        return self


def _record_file(data: object) -> object:
    """`record: run.mcap` is short for a mapping with only `to`."""
    return {"to": data} if isinstance(data, str) else data


class GraphKeys(Section):
    """Keys that a file and a group have in common."""

    namespace: str | None = Field(default=None, description="Put before all nodes and relative topics in it.")
    defaults: DefaultKeys = Field(default=DefaultKeys(), description="Defaults for every node in it.")
    topics: dict[str, TopicKeys] = Field(default_factory=dict, description="Contracts of topics, by final name.")
    nodes: dict[str, NodeKeys] = Field(default_factory=dict, description="The nodes, by name or namespace/name.")
    programs: dict[str, ProgramKeys] = Field(
        default_factory=dict,
        description="Programs of any language that run beside the nodes, by name or namespace/name.",
    )
    groups: "dict[str, GroupKeys]" = Field(
        default_factory=dict, description="Nodes that share a namespace or defaults."
    )
    include: Annotated[list[IncludeKeys], BeforeValidator(_include_list)] = Field(
        default_factory=list[IncludeKeys], description="Launch files whose nodes run too."
    )


class GroupKeys(GraphKeys, Repeatable):
    """Nodes that share a namespace, defaults, a `for_each` or a `when`."""


class ProfileKeys(GraphKeys):
    """Changes to a launch file when the profile is chosen."""

    name: str | None = Field(default=None, min_length=1, description="The run's name; by default the file's.")
    plugins: list[str] = Field(default_factory=list[str], description="Folders of plugins, relative to this file.")
    interfaces: list[str] = Field(
        default_factory=list[str],
        description="Folders of .msg, .srv and .action files, or of packages of them, relative to this file.",
    )
    args: dict[str, Any] = Field(default_factory=dict, description="Other defaults, choices or ranges of arguments.")
    env: Environment = Field(
        default_factory=dict, description="Variables of the environment, for ${env.NAME} and for the nodes."
    )
    qos: dict[str, dict[str, Any]] = Field(default_factory=dict, description="Named QoS profiles.")
    processes: dict[str, ProcessKeys] = Field(
        default_factory=dict, description="Processes that nodes may run in, beside the main one."
    )
    machines: dict[str, MachineKeys] = Field(
        default_factory=dict, description="Machines that nodes may run on, beside the main one."
    )
    network: NetworkKeys = Field(default=NetworkKeys(), description="Links between machines, and others that may join.")
    frames: dict[str, dict[str, FrameKeys]] = Field(
        default_factory=dict[str, dict[str, FrameKeys]],
        description="Frames that never move, by parent and name; published on /tf_static.",
    )
    packages: dict[str, str] = Field(
        default_factory=dict[str, str],
        description="Folders, relative to this file, that package://NAME/… in a robot's description means.",
    )
    clock: ClockKeys = Field(default=ClockKeys(), description="The clock of the run.")
    seed: int | None = Field(default=None, ge=0, description="Decides every random number of the run.")
    record: Annotated[RecordKeys | None, BeforeValidator(_record_file)] = Field(
        default=None, description="What to write into a file while the graph runs."
    )
    expect: ExpectKeys = Field(default=ExpectKeys(), description="What has to hold, checked by `busflow test`.")
    shutdown: ShutdownKeys = Field(default=ShutdownKeys(), description="How the run ends.")


def _version(text: str | None) -> str | None:
    return None if text is None else check_requirement(text)


class LaunchKeys(ProfileKeys):
    """A launch file of busflow: the nodes of a graph and their settings."""

    later: ClassVar[Mapping[str, str]] = {
        "version": "write busflow: '>=0.1' for the versions of busflow that the file is for",
    }

    busflow: Annotated[str | None, AfterValidator(_version)] = Field(
        default=None, description="The versions of busflow that the file is for: `>=0.1,<0.3`."
    )
    args: dict[str, ArgumentKeys] = Field(default_factory=dict, description="Arguments, used as ${args.name}.")
    profile: str | None = Field(default=None, description="The profile to use if none is chosen.")
    profiles: dict[str, ProfileKeys] = Field(
        default_factory=dict[str, ProfileKeys], description="What is different under a name: `--profile NAME`."
    )

    @model_validator(mode="after")
    def _one_seed(self) -> Self:
        if self.seed is not None and self.clock.seed not in {None, self.seed}:
            raise ValueError(f"seed is {self.seed} and clock.seed is {self.clock.seed}; state it once")
        return self


ORDER = (
    *("busflow", "name", "plugins", "interfaces", "args", "env", "profile", "profiles", "qos", "defaults", "topics"),
    *("nodes", "programs", "groups", "processes", "machines", "network", "include", "packages", "frames"),
    *("namespace", "clock", "seed", "record", "expect", "shutdown"),
)
"""Keys of a launch file in the order in which a person would write them."""
