"""A worker process runs the nodes that it is assigned, as the main process starts it, and reports how it ended."""

import asyncio
import os
import sys
from contextlib import closing
from typing import Any

import pytest

from busflow.errors import ExitCode
from busflow.processes.assignment import Assignment, Memory
from busflow.processes.child import Child
from busflow.runner.garbage import THRESHOLDS
from busflow.runner.source import Source
from busflow.wire.zenoh.run_directory import RunCard, RunDirectory
from tests.processes.conftest import NODES

PATIENCE_S = 60.0
LAUNCH = """
plugins: [NODES]
nodes:
  own: {plugin: assigned, process: left, parameters: {then: THEN}}
  other: {plugin: printing}
processes:
  left: {}
"""


class Messages:
    """What a worker reports and prints."""

    def __init__(self) -> None:
        self.reported: list[Any] = []
        self.printed: list[str] = []
        self.ready = asyncio.Event()
        self._loop = asyncio.get_running_loop()

    def on_message(self, message: Any) -> None:
        self.reported.append(message)
        if message.get("log", [None] * 4)[3] == "ready":
            self._loop.call_soon_threadsafe(self.ready.set)

    def on_print(self, line: str, *, error: bool) -> None:
        self.printed.append(f"{'error' if error else 'output'}: {line}")

    @property
    def end(self) -> Any:
        (end,) = [each["end"] for each in self.reported if "end" in each]
        return end

    def log(self, event: str) -> Any:
        (values,) = [each["log"][4] for each in self.reported if each.get("log", [None] * 4)[3] == event]
        return values


def assignment(directory: RunDirectory, **changes: Any) -> Assignment:
    card = RunCard("worker", os.getpid(), 1)
    directory.write_card(card)
    whole: dict[str, Any] = {
        "process": "left", "socket": "1.sock", "earlier": ("main.sock",), "directory": str(directory.path),
        "card": card, "nodes": ("/own",), "others": (), "seed": 1, "log_level": "info",
        "ros2_listens": "", "ros2_dials": (), "restarts": 0, "nice": 0, "env": {}, "outer": {},
        "watchdog_s": None, "prints_failures": False, "path": tuple(sys.path), "memory": Memory(),
        "event_loop": "busflow", "timeouts": {},
    }  # fmt: skip
    return Assignment(**whole | changes)


async def worked(folder: Any, then: str, *orders: bytes, act: Any = None, **changes: Any) -> tuple[int, Messages]:
    """Run a worker to its end; orders and `act` follow once its node runs. Return its exit code and its messages."""
    (folder / "run.yaml").write_text(LAUNCH.replace("NODES", str(NODES)).replace("THEN", then))
    messages = Messages()
    with closing(RunDirectory.claim("worker")) as directory:
        source = Source(folder / "run.yaml")
        line = assignment(directory, source=source, path=(str(folder), *sys.path), **changes).line()
        command = (sys.executable, "-P", "-m", "busflow.processes.worker", "left")
        async with asyncio.timeout(PATIENCE_S):
            child = Child(command, {**os.environ, "GONE": "1"}, lambda: line, messages)
            try:
                if act is not None:
                    await messages.ready.wait()
                    for order in orders:
                        child.send(order)
                    act(child)
                return await child.ended(), messages
            finally:
                child.kill()


pytestmark = pytest.mark.asyncio


async def test_only_assigned_nodes_run_and_are_reported(tmp_path: Any):
    stated: dict[str, Any] = {"env": {"OWN": "a"}, "outer": {"OUTER": "b", "GONE": None}, "timeouts": {"grace": 7.0}}
    code, messages = await worked(tmp_path, "end", nice=3, **stated)
    assert code == ExitCode.OK, messages.printed
    assert messages.end == {"exit_code": 0, "failures": [], "finished": True}
    assert messages.printed == [], "the other node is the main process's"
    assert messages.log("ready") == {"values": "['a', 'b', None]", "nice": os.nice(0) + 3, "grace": 7.0}
    report = [each["report"] for each in messages.reported if each.get("report")][-1]
    assert [node["name"] for node in report["nodes"]] == ["/own"]


async def test_garbage_is_collected_in_steps(tmp_path: Any):
    code, messages = await worked(tmp_path, "collect")
    assert code == ExitCode.OK, messages.printed
    assert messages.log("frozen") == {"thresholds": str(THRESHOLDS)}


async def test_failure_of_a_node_is_reported_in_words(tmp_path: Any):
    code, messages = await worked(tmp_path, "fail", prints_failures=True)
    assert (code, messages.end["exit_code"]) == (ExitCode.FAILED, ExitCode.FAILED)
    (failure,) = messages.end["failures"]
    assert "/own" in failure
    assert "AttributeError: absent" in failure


async def test_end_of_the_main_process_ends_it(tmp_path: Any):
    """Also after orders that are none."""
    code, messages = await worked(
        tmp_path,
        "wait",
        *(b"nonsense\n", b"[]\n", b'{"snapshot": 1}\n'),
        act=lambda child: os.close(child._process.stdin.fileno()),
    )
    assert code == 128 + 15, messages.printed
    assert (messages.end["exit_code"], messages.end["failures"]) == (143, [])
