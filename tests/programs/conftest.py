"""What the tests of programs need: graphs of launch files that start real programs, in this process."""

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from busflow.launchfile.load.load import load
from busflow.log import LogRecord
from busflow.runner import assembly
from busflow.runner.assembly import Given, Kind
from tests.processes.conftest import NODES, Run, starting

PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""


class Log:
    """The lines of a run so far, and the wait for one."""

    def __init__(self) -> None:
        self.lines: list[LogRecord] = []
        self._waiting: list[tuple[str, asyncio.Event, asyncio.AbstractEventLoop]] = []

    def write(self, record: LogRecord) -> None:
        self.lines.append(record)
        for text, event, loop in self._waiting:
            if text in record.event:
                loop.call_soon_threadsafe(event.set)

    def texts(self, *names: str) -> list[str]:
        """What was logged under these names."""
        return [each.event for each in self.lines if each.node in names]

    async def wait_for(self, text: str) -> None:
        """Wait for a line with a text."""
        event = asyncio.Event()
        self._waiting.append((text, event, asyncio.get_running_loop()))
        if not any(text in each.event for each in self.lines):
            await event.wait()


class Launched:
    """A graph with programs, once it has run."""

    def __init__(self, text: str, folder: Path) -> None:
        (folder / "run.yaml").write_text(f"plugins: [{NODES}]\n{text}")
        description = load(folder / "run.yaml")
        self.log = Log()
        self.graph = assembly.Run([description], Kind.LAUNCH, Given(sinks=(self.log.write,))).build()

    def account(self, name: str) -> Any:
        """The report of a program."""
        (found,) = [each for each in self.graph.report().programs if each.name == name]
        return found


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "plugins").mkdir()
    return tmp_path


@pytest.fixture
def launched(project: Path) -> Callable[..., Launched]:
    """Runs a launch file to its end; `act` is awaited once it has started, and then the run is stopped."""

    def launched(text: str, act: Callable[[Launched], Awaitable[None]] | None = None) -> Launched:
        async def main() -> Launched:
            async with asyncio.timeout(PATIENCE_S):
                run = Launched(text, project)
                await run.graph.start()
                if act is not None:
                    await act(run)
                    await run.graph.stop()
                await run.graph.wait()
                return run

        return asyncio.run(main())

    return launched


@pytest.fixture
def start(project: Path) -> Iterator[Callable[..., Run]]:
    """Starts `busflow run` of a launch file, and ends whatever is left of it."""
    with starting(project) as start:
        yield start
