"""A run, a bridge and programs of DDS alone, each in a process of its own, in a domain that no other test uses."""

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from time import monotonic
from typing import Any

import pytest

from tests.extras import require_extra


class WithoutDDS(pytest.Module):
    """A file of tests that cannot be imported."""

    def collect(self) -> list[pytest.Item]:
        require_extra("dds")
        return []


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module | None:
    return None if find_spec("cyclonedds") else WithoutDDS.from_parent(parent, path=module_path)


PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""
ROBOT = """
import busflow
from busflow import *
from busflow.msgs.example_interfaces import AddTwoInts
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Float64, Int64, String
LATCHED = QoS(durability="transient_local", depth=2)

class Driver(Node):
    speed = publisher(Float64, "speed")
    map_name = publisher(String, "map_name", qos=LATCHED)
    picture = publisher(Image, "picture")
    other_add = client(AddTwoInts, "other_add")

    async def start(self) -> None:
        for name in ("cellar", "kitchen", "attic"):
            self.map_name.publish(String(data=name))
        self.log.info("ready")

    @timer(0.05)
    def tick(self) -> None:
        self.speed.publish(Float64(data=1.5))

    @subscription("command")
    def on_command(self, message: Float64) -> None:
        self.log.info(f"command {message.data}")

    @subscription("goal", qos=LATCHED)
    def on_goal(self, message: String) -> None:
        self.log.info(f"goal {message.data}")

    @subscription("count", qos=QoS(depth=1000))
    def on_count(self, message: Int64) -> None:
        if message.data % 100 == 99:
            self.log.info(f"count {message.data}")

    @subscription("camera", qos=QoS(depth=2))
    def on_camera(self, message: Image) -> None:
        self.log.info(f"camera {len(message.data)} {int(message.data[:9].sum())}")

    @subscription("ask_other")
    async def on_ask(self, message: Int64) -> None:
        answer = await self.other_add.call(AddTwoInts.Request(a=message.data, b=1))
        self.log.info(f"answer {answer.sum}")

    @subscription("show")
    def on_show(self, message: Int64) -> None:
        import numpy as np
        data = np.resize(np.arange(250, dtype=np.uint8), message.data)
        self.picture.publish(Image(height=1, width=message.data, step=message.data, data=data))

    @service(AddTwoInts, "add")
    def on_add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)
"""


DOMAIN = "DOMAIN"
"""What stands for a domain in a command, before one is found."""


class Lines:
    """Lines that arrive from elsewhere, and are kept."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._arrived = threading.Condition()
        self._ended = False

    def add(self, line: str) -> None:
        """Add a line."""
        with self._arrived:
            self.lines.append(line)
            self._arrived.notify_all()

    def wait_for(self, condition: str | Callable[[str], Any], *, after: int = 0) -> Any:
        """Wait for a line that holds this text, or of which this is true; return what is true."""
        holds = (lambda line: condition in line and line) if isinstance(condition, str) else condition

        def first() -> Any:
            return next((found for line in self.lines[after:] if (found := holds(line))), None)

        with self._arrived:
            self._arrived.wait_for(lambda: self._ended or first(), timeout=PATIENCE_S)
            assert first(), f"{condition} never came: {self.lines[-30:]}"
            return first()


class BridgeHere(Lines):
    """A bridge in a thread of this process, so that it can be seen which of its lines run."""

    def __init__(self, domain: int, environment: Mapping[str, str]) -> None:
        """Open it for the run `robot`."""
        from busflow.bus.patterns import Selection
        from busflow.dds.bridge import DdsBridge
        from busflow.wire.zenoh.run_directory import find_run

        super().__init__()
        self._bridge = DdsBridge(find_run("robot", environment), domain, Selection(), log=self.add)
        self._thread = threading.Thread(target=self._bridge.serve, daemon=True)
        self._thread.start()

    def end(self, _number: int = signal.SIGINT) -> None:
        """Close it."""
        self._bridge.stop()
        self._thread.join(PATIENCE_S)
        self._bridge.close()


class Program(Lines):
    """A process whose lines on one of its streams are kept."""

    def __init__(self, *arguments: str, environment: dict[str, str] | None = None, log: bool = True) -> None:
        """Start it; its lines are those of its log, on standard error, or else of its output."""
        pipes = {"stderr" if log else "stdout": subprocess.PIPE}
        self.process = subprocess.Popen(
            [sys.executable, *arguments],
            stdin=subprocess.PIPE,
            text=True,
            env={**os.environ, **(environment or {})},
            **pipes,
        )
        super().__init__()
        self._stream: Any = self.process.stderr if log else self.process.stdout
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        for line in self._stream:
            self.add(line)
        with self._arrived:
            self._ended = True
            self._arrived.notify_all()

    def end(self, number: int = signal.SIGINT) -> int:
        """Send a signal, and return the exit code."""
        with suppress(ProcessLookupError):
            self.process.send_signal(number)
        try:
            return self.process.wait(PATIENCE_S)
        finally:
            self.process.kill()
            self.process.wait()
            self._thread.join(PATIENCE_S)
            self._stream.close()
            with suppress(BrokenPipeError):
                self.process.stdin.close()


class DdsPeer(Program):
    """A program of DDS alone, `peer.py` or one that does more."""

    def __init__(self, domain: int, enclave: str = "", program: str = "peer.py") -> None:
        """Start it; with an enclave, it says that it is a participant of ROS 2, which lists its nodes."""
        super().__init__(str(Path(__file__).with_name(program)), str(domain), enclave, log=False)
        self.wait_for("ready")

    def do(self, what: str, **values: Any) -> None:
        """Have it do something, and wait until it has."""
        before = sum("done" in line for line in self.lines)
        self.process.stdin.write(json.dumps({"do": what, **values}) + "\n")
        self.process.stdin.flush()
        with self._arrived:
            self._arrived.wait_for(
                lambda: self._ended or sum("done" in line for line in self.lines) > before, PATIENCE_S
            )
        assert not self._ended, self.lines[-10:]

    def said(self, *, after: int = 0, **wanted: Any) -> dict[str, Any]:
        """Wait until it has said this, and return the whole of it."""

        def holds(line: str) -> Any:
            found = json.loads(line)
            return found if wanted.items() <= found.items() else None

        return self.wait_for(holds, after=after)

    def mark(self) -> int:
        """The number of lines until now."""
        return len(self.lines)


@contextmanager
def own_domain() -> Iterator[int]:
    """A domain that no other tests on this machine take: they hold its port, of TCP, which DDS leaves free."""
    for domain in range(30, 100):
        with socket.socket() as held:
            try:
                held.bind(("127.0.0.1", 7400 + 250 * domain))
            except OSError:
                continue
            yield domain
            return
    raise AssertionError("no domain is free")


class Stage:
    """A run with its bridge, and peers in their domain."""

    bridge: Program | BridgeHere

    def __init__(self, domain: int, ending: ExitStack, folder: str, command: Sequence[str]) -> None:
        self.domain, self._ending, self._environment = domain, ending, {"BUSFLOW_RUNTIME_DIR": folder}
        self.robot = self.start(Program, *(each.replace(DOMAIN, str(domain)) for each in command))

    def start(self, kind: Any, *arguments: Any, **words: Any) -> Any:
        """Start a program, which ends with the stage."""
        if kind is Program:
            words.setdefault("environment", self._environment)
        started = kind(*arguments, **words)
        self._ending.callback(started.end, signal.SIGKILL if kind is DdsPeer else signal.SIGINT)
        return started

    def open_bridge(self, *options: str) -> Program:
        """Open a bridge of the run."""
        bridge = self.start(Program, "-m", "busflow", "dds", "--run", "robot", "--domain", str(self.domain), *options)
        bridge.wait_for("see each other")
        return bridge

    def open_bridge_here(self) -> BridgeHere:
        """Open a bridge of the run in this process, whose environment has to be the run's."""
        return self.start(BridgeHere, self.domain, self._environment)

    @property
    def environment(self) -> Mapping[str, str]:
        """The variables by which the run is found."""
        return self._environment

    def peer(self, enclave: str = "", *, domain: int | None = None, program: str = "peer.py") -> DdsPeer:
        """Start a program of DDS alone."""
        return self.start(DdsPeer, self.domain if domain is None else domain, enclave, program)

    def busflow(self, *arguments: str) -> str:
        """Return what a command prints on standard output."""
        command = [sys.executable, "-m", "busflow", *arguments, "--run", "robot"]
        done = subprocess.run(
            command, capture_output=True, text=True, env={**os.environ, **self._environment}, timeout=PATIENCE_S
        )
        return done.stdout + done.stderr

    def start_alone(self, program: str, *arguments: str) -> Program:
        """Start a program of this folder, whose output is kept."""
        return self.start(Program, str(Path(__file__).with_name(program)), *arguments, log=False)

    def until(self, text: str, *arguments: str) -> str:
        """Return what a command prints, once it prints this text."""
        for printed in self._printed(*arguments):
            if text in printed:
                return printed
        raise AssertionError(f"{text} is not in what {arguments} print")

    def until_not(self, text: str, *arguments: str) -> None:
        """Wait until a command does not print this text any more."""
        if all(text in printed for printed in self._printed(*arguments)):
            raise AssertionError(f"{text} is still in what {arguments} print")

    def _printed(self, *arguments: str) -> Iterator[str]:
        """Yield what a command prints, again and again for as long as is waited for anything."""
        end_s = monotonic() + PATIENCE_S
        while monotonic() < end_s:
            yield self.busflow(*arguments)


@contextmanager
def staged(*command: str) -> Iterator[Stage]:
    """A stage whose run is started by this command of Python, in which `DOMAIN` stands for the domain."""
    with own_domain() as domain, tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as folder, ExitStack() as ending:
        yield Stage(domain, ending, folder, command)


@pytest.fixture
def stage_of() -> Iterator[Callable[..., Stage]]:
    """Return a function that sets up a stage whose run is started by a command of Python."""
    with ExitStack() as ending:
        yield lambda *command: ending.enter_context(staged(*command))


SCRIPT = f"{ROBOT}\nimport sys; sys.exit(busflow.run(Driver, inspect='robot'))"


@pytest.fixture(scope="module")
def stage() -> Iterator[Stage]:
    """A run, its bridge, and a domain for peers, for all tests of a module."""
    with staged("-c", SCRIPT) as found:
        found.robot.wait_for("ready")
        found.bridge = found.open_bridge()
        yield found


@pytest.fixture
def other_domain() -> Iterator[int]:
    """One more domain that no other test uses."""
    with own_domain() as found:
        yield found
