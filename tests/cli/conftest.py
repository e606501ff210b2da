"""Small launch files with two nodes each: one in a folder of its own, and one that runs while commands look at it."""

import os
import pty
import re
import signal
import subprocess
import sys
import tempfile
import termios
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

TALKER = '''
from busflow import Node, Parameters, publisher, timer
from busflow.msgs.std_msgs import Float64


class TalkerParameters(Parameters):
    rate_hz: float = 100.0
    fail_at: int = 0


class Talker(Node):
    """Counts aloud."""

    parameters: TalkerParameters
    numbers = publisher(Float64, "numbers")
    count = 0

    @timer(hz="rate_hz")
    def talk(self) -> None:
        self.count += 1
        if 0 < self.parameters.fail_at <= self.count:
            raise ValueError("\\x1b[31mlost count")
        self.numbers.publish(Float64(data=float(self.count)))
'''

LISTENER = '''
from busflow import Node, subscription
from busflow.msgs.std_msgs import Float64


class Listener(Node):
    """Logs what it receives."""

    @subscription("numbers")
    def receive(self, number: Float64) -> None:
        self.log.info("heard", number=number.data)
'''

LAUNCH = """\
name: talk
plugins: [plugins]
args:
  rate_hz: {type: float, default: 100.0, max: 1000, help: How often to talk.}
nodes:
  talker:
    plugin: talker
    parameters: {rate_hz: "${args.rate_hz}"}
  listener:
    plugin: listener
"""

IMU_PUBLISHER = '''
from pydantic import Field

from busflow import SENSOR_DATA, Node, Parameters, ReadOnly, publisher, timer
from busflow.msgs.sensor_msgs import Imu, JointState


class ImuPublisherParameters(Parameters):
    rate_hz: float = Field(default=10.0, ge=0.1, le=1000, description="publish rate in Hz")
    frame_id: ReadOnly[str] = Field(default="imu_link", description="frame id of the Imu message")
    joint_count: int = 10


class ImuPublisher(Node):
    """The publisher of ROS 2's lab, whose verbatim outputs are in tests/cases/ros2cli."""

    parameters: ImuPublisherParameters
    imu = publisher(Imu, "imu/data", qos=SENSOR_DATA)
    joints = publisher(JointState, "joint_states")

    @timer(hz="rate_hz")
    def tick(self) -> None:
        stamp = self.clock.now().to_msg()
        header = Imu().header.replace(stamp=stamp, frame_id=self.parameters.frame_id)
        self.imu.publish(Imu(header=header))
        count = self.parameters.joint_count
        self.joints.publish(JointState(header=header, name=[f"j{n}" for n in range(count)], position=[0.5] * count))
'''

PROCESSOR = '''
from busflow import SENSOR_DATA, Node, publisher, subscription
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import Float64


class Processor(Node):
    """Its processor."""

    balance = publisher(Float64, "balance_state")
    stability = publisher(Float64, "stability_index")
    said = False

    @subscription("imu/data", qos=SENSOR_DATA)
    def on_imu(self, imu: Imu) -> None:
        self.balance.publish(Float64(data=0.25))
        self.stability.publish(Float64(data=0.75))
        if not self.said:
            self.said = True
            self.log.info("works", path="\\x1b[31m")

    @subscription("joint_states")
    def on_joints(self, joints: JointState) -> None:
        pass
'''

IMU_LAB = """\
name: imu_lab
plugins: [plugins]
nodes:
  imu_publisher:
    plugin: imu_publisher
    parameters: {rate_hz: 10.0}
  processor:
    plugin: processor
"""

ODDS = '''
import asyncio

import numpy as np

from busflow import QoS, Message, Node, publisher, subscription, timer
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Float64, Int64, String


class Note(Message, package="odd"):
    """What ROS has no words for."""

    text: str
    place: str | None = None
    marks: dict[str, float] = {}


class Odds(Node):
    """Topics as they are not in the lab: large, latched, kept, foreign to ROS, flooded, without a subscription."""

    image = publisher(Image, "camera/image")
    talk = publisher(String, "talk")
    note = publisher(Note, "note")
    name_of_map = publisher(String, "map_name", qos=QoS(durability="transient_local"))
    numbers = publisher(Int64, "numbers")
    flood = publisher(Int64, "flood")
    commanded = publisher(Float64, "commanded")
    unused = publisher(Int64, "_hidden/count")
    count = 0

    async def start(self) -> None:
        self.pixels = np.zeros(1920 * 1080 * 3, np.uint8)
        self.name_of_map.publish(String(data="attic"))
        self.log.info("ready")

    @timer(0.2)
    def show(self) -> None:
        self.image.publish(Image(height=1080, width=1920, encoding="rgb8", step=5760, data=self.pixels))
        self.talk.publish(String(data="\\x1b[31mred\\u202e"))
        self.note.publish(Note(text="a, b", marks={"x": float("inf")}))

    @timer(0.01)
    def tick(self) -> None:
        self.count += 1
        self.numbers.publish(Int64(data=self.count))
        self.flood.publish(Int64(data=self.count))

    @subscription("flood", qos=QoS(depth=1))
    async def on_flood(self, number: Int64) -> None:
        await asyncio.sleep(0.05)

    @subscription("cmd")
    def on_command(self, command: Float64) -> None:
        self.commanded.publish(command)

    @subscription("strict", qos=QoS(deadline=900, lease=800, liveliness="manual_by_topic"))
    def on_strict(self, command: Float64) -> None:
        self.commanded.publish(command)
'''

ODD_LAB = """\
name: odd_lab
plugins: [plugins]
topics:
  numbers: {history: 5}
nodes:
  odds:
    plugin: odds
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins/talker.py").write_text(TALKER)
    (tmp_path / "plugins/listener.py").write_text(LISTENER)
    (tmp_path / "talk.yaml").write_text(LAUNCH)
    monkeypatch.chdir(tmp_path)
    return tmp_path


class LiveRun:
    """A `busflow run` in a process of its own; what it logs is kept."""

    def __init__(self, folder: Path, *arguments: str, environment: Mapping[str, str]) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "busflow", "run", *arguments],
            cwd=folder,
            env={**environment},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.lines: list[str] = []
        self._arrived = threading.Condition()
        self._ended = False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        with self.process.stderr as stream:
            for line in stream:
                with self._arrived:
                    self.lines.append(line)
                    self._arrived.notify_all()
        with self._arrived:
            self._ended = True
            self._arrived.notify_all()

    def wait_for(self, text: str) -> None:
        """Wait until it has logged a line with this text."""
        with self._arrived:
            self._arrived.wait_for(lambda: self._ended or any(text in line for line in self.lines), timeout=60)
        assert any(text in line for line in self.lines), self.lines

    def stop(self) -> None:
        """Press Ctrl-C, and wait for its end."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(timeout=60)
            finally:
                self.process.kill()  # or it would be there for the tests that follow
        self._reader.join(timeout=60)


class Place:
    """A runtime directory of its own, short enough for a socket, which pytest's own are not."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": str(path)}

    def run(self, folder: Path, *arguments: str) -> LiveRun:
        """Start a run in this runtime directory."""
        return LiveRun(folder, *arguments, environment=self.environment)

    def look(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Let commands of this process find the runs of this directory, and no others."""
        monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(self.path))


@contextmanager
def standing(
    folder: Path, name: str, launch_file: str, plugins: Mapping[str, str], *options: str
) -> Iterator[tuple[Place, LiveRun]]:
    """Run a launch file with its plugins, in a place of its own, while the block lasts."""
    (folder / "plugins").mkdir()
    for plugin, source in plugins.items():
        (folder / f"plugins/{plugin}.py").write_text(source)
    (folder / f"{name}.yaml").write_text(launch_file)
    with tempfile.TemporaryDirectory(prefix="busflow-") as path:
        place = Place(Path(path))
        run = place.run(folder, f"{name}.yaml", *options)
        try:
            yield place, run
        finally:
            run.stop()


@pytest.fixture(scope="module")
def stand(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., tuple[Place, LiveRun]]]:
    """Return a function that starts a run in a place of its own, for all tests of a module, which do not change it."""
    with ExitStack() as stack:

        def start(name: str, launch_file: str, plugins: Mapping[str, str]) -> tuple[Place, LiveRun]:
            return stack.enter_context(standing(tmp_path_factory.mktemp(name), name, launch_file, plugins))

        yield start


@pytest.fixture(scope="session")
def imu_lab(tmp_path_factory: pytest.TempPathFactory, lasting: set[int]) -> Iterator[Place]:
    """The place of a run of the lab of ROS 2's captures, for the whole session."""
    plugins = {"imu_publisher": IMU_PUBLISHER, "processor": PROCESSOR}
    options = ("-v", "--watchdog", "off")  # which would log a busy machine, in a log that is compared
    with standing(tmp_path_factory.mktemp("imu_lab"), "imu_lab", IMU_LAB, plugins, *options) as (place, run):
        lasting.add(run.process.pid)
        run.wait_for("works")
        yield place


@pytest.fixture
def lab(imu_lab: Place, monkeypatch: pytest.MonkeyPatch) -> Place:
    """The running lab, found by commands of this process."""
    imu_lab.look(monkeypatch)
    return imu_lab


@pytest.fixture(scope="module")
def odd_lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Place]:
    """The place of the run with the odd topics; it takes much of a processor, so it ends with the module."""
    with standing(tmp_path_factory.mktemp("odd_lab"), "odd_lab", ODD_LAB, {"odds": ODDS}) as (place, run):
        run.wait_for("ready")
        yield place


@pytest.fixture
def odds(odd_lab: Place, monkeypatch: pytest.MonkeyPatch) -> Place:
    """The run with the odd topics, found by commands of this process."""
    odd_lab.look(monkeypatch)
    return odd_lab


@pytest.fixture(scope="module")
def lab1() -> Iterator[tuple[Place, LiveRun]]:
    """The place of a run of the project's own lab, for all tests of a module."""
    with tempfile.TemporaryDirectory(prefix="busflow-") as path:
        place = Place(Path(path))
        run = place.run(Path(__file__).parents[2], "configs/lab1.yaml")
        try:
            run.wait_for("All sensors operational")
            yield place, run
        finally:
            run.stop()


@pytest.fixture
def place(monkeypatch: pytest.MonkeyPatch) -> Iterator[Place]:
    """An empty place, where commands of this process look for runs."""
    with tempfile.TemporaryDirectory(prefix="busflow-") as path:
        found = Place(Path(path))
        found.look(monkeypatch)
        yield found


@pytest.fixture
def start_run(place: Place) -> Iterator[Callable[..., LiveRun]]:
    """Return a function that starts runs in that place; they are stopped after the test."""
    with ExitStack() as started:

        def start(folder: Path, *arguments: str) -> LiveRun:
            run = place.run(folder, *arguments)
            started.callback(run.stop)
            return run

        yield start


ROS2 = Path(__file__).parents[1] / "cases/ros2cli"
_ROS_ALONE = ("rcl_interfaces/", "type_description", "use_sim_time")
"""Topics, parameters and services that every node of ROS 2 has and ours do not."""


@pytest.fixture
def ros2_said() -> Callable[[str], str]:
    """Return the output of a ROS 2 command in the same lab, without what only ROS 2's nodes have."""

    def said(name: str) -> str:
        lines = (ROS2 / f"{name}.txt").read_text(encoding="utf-8").splitlines()[1:-1]
        return "".join(f"{line}\n" for line in lines if not any(word in line for word in _ROS_ALONE))

    return said


@pytest.fixture
def ros2_file() -> Callable[[str], str]:
    """Return the whole output of a ROS 2 command in the same lab."""

    def read(name: str) -> str:
        return "".join(f"{line}\n" for line in (ROS2 / f"{name}.txt").read_text(encoding="utf-8").splitlines()[1:-1])

    return read


@pytest.fixture
def in_terminal() -> Callable[..., list[str]]:
    """Return a function that runs a command in a terminal of some width and returns the printed lines."""

    def run(columns: int, *arguments: str) -> list[str]:
        screen, terminal = pty.openpty()
        termios.tcsetwinsize(terminal, (24, columns))
        environment = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "NO_COLOR")}
        command = [sys.executable, "-m", "busflow", *arguments]
        shown = bytearray()
        with subprocess.Popen(
            command, stdout=terminal, stderr=subprocess.DEVNULL, env={**environment, "TERM": "xterm"}
        ) as process:
            os.close(terminal)
            with suppress(OSError):  # how Linux reports a closed terminal
                while part := os.read(screen, 65536):
                    shown += part
        os.close(screen)
        assert process.returncode == 0
        return re.sub(r"\x1b\[[0-9;]*m", "", shown.decode()).splitlines()

    return run
