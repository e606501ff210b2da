"""Child: one process of the operating system, from start to end, with its messages and prints.

A thread reads its pipes, so that a busy event loop here does not delay the child, nor the child the loop.
"""

from __future__ import annotations

import asyncio
import json
import os
import selectors
import signal
import site
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

import busflow

_PIECE = 1 << 16
_LINE_BYTES = 4096
"""Length of the longest printed line that is passed on in one piece."""
_REPORT_BYTES = 1 << 24


def module_command(module: str, *arguments: str) -> list[str]:
    """Return the command of a `Child` that runs a module; with -P it imports nothing of the folder it starts in."""
    return [sys.executable, "-P", "-m", module, *arguments]


def busflow_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment in which a process finds the same busflow as this one."""
    home = str(Path(busflow.__file__).parents[1])
    if home in (*site.getsitepackages(), site.getusersitepackages()):
        return dict(environment)
    known = environment.get("PYTHONPATH")
    return {**environment, "PYTHONPATH": f"{home}{os.pathsep}{known}" if known else home}


class ChildSink(Protocol):
    """Receives a child's messages and prints, in the thread that reads them."""

    def on_message(self, message: Mapping[str, Any]) -> None:
        """Handle a message of the child."""
        ...

    def on_print(self, line: str, *, error: bool) -> None:
        """Handle a line that the child printed."""
        ...


class Child:
    """A started process of the operating system."""

    def __init__(
        self,
        command: Sequence[str],
        environment: Mapping[str, str],
        first_line: Callable[[], bytes],
        sink: ChildSink,
        *,
        inherited: Sequence[int] = (),
    ) -> None:
        """Start the process: a new one, never a fork of this one.

        Args:
            command: the program and its arguments; the number of the pipe for its messages is put after them.
            environment: all variables of the process.
            first_line: returns the line that the process reads first, on its standard input.
            sink: receives its messages and prints.
            inherited: files that it has open from its start, with the same numbers as here.

        Raises:
            OSError: the system cannot start it.
        """
        reading, writing = os.pipe()
        try:
            self._process = subprocess.Popen(  # noqa: S603  # our own interpreter and our own arguments
                [*command, str(writing)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env=dict(environment),
                pass_fds=(writing, *inherited),
                process_group=0,  # the terminal's Ctrl-C goes to the main process only, which stops the others in order
            )
        except OSError:
            os.close(reading)
            raise
        finally:
            os.close(writing)
        self.pid: int = self._process.pid
        self._sink, self._first_line = sink, first_line
        self._loop = asyncio.get_running_loop()
        self._ended: asyncio.Future[int] = self._loop.create_future()
        self._rest = {"report": b"", "out": b"", "err": b""}
        self._thread = threading.Thread(
            target=self._listen, args=(reading,), name=f"busflow.child.{self.pid}", daemon=True
        )
        self._thread.start()

    async def ended(self) -> int:
        """Wait for the end; return the exit code, or the negative number of the signal that killed the process."""
        return await asyncio.shield(self._ended)

    def send(self, line: bytes) -> None:
        """Write a line to the process, which has read its first line already."""
        with suppress(OSError, ValueError):  # it has ended
            os.write(self._process.stdin.fileno(), line)  # pyright: ignore[reportOptionalMemberAccess]  # it is a pipe

    def terminate(self) -> None:
        """Ask the process to stop."""
        self._process.terminate()

    def kill(self) -> None:
        """Kill the process now."""
        self._process.kill()

    def _await_end(self, end_pipe: int) -> None:
        """Wait for the child's end, kill the processes that it leaves in its group, and close a pipe as a signal."""
        self._process.wait()
        with suppress(OSError):  # nothing is left
            os.killpg(self.pid, signal.SIGKILL)
        os.close(end_pipe)

    def _listen(self, report_pipe: int) -> None:
        process = self._process
        end_pipe, ended = os.pipe()
        threading.Thread(target=self._await_end, args=(ended,), name="busflow.child.end", daemon=True).start()
        assert process.stdin is not None  # noqa: S101  # all three are pipes
        assert process.stdout is not None  # noqa: S101  # see above
        assert process.stderr is not None  # noqa: S101  # see above
        with suppress(OSError):  # the process ended before it had read anything
            process.stdin.write(self._first_line())
            process.stdin.flush()
        with selectors.DefaultSelector() as pipes:
            names = {report_pipe: "report", process.stdout.fileno(): "out", process.stderr.fileno(): "err"}
            for pipe in names:
                os.set_blocking(pipe, False)
                pipes.register(pipe, selectors.EVENT_READ)
            pipes.register(end_pipe, selectors.EVENT_READ)
            # The ends of the child's pipes do not show its end: a process that it forked holds them open too.
            while end_pipe not in (ready := [key.fd for key, _ in pipes.select()]):
                for pipe in ready:
                    self._read(pipe, names[pipe], pipes)
            pipes.unregister(end_pipe)
            code = process.wait()
            for key in tuple(pipes.get_map().values()):
                self._read(key.fd, names[key.fd], pipes)
        for name, rest in self._rest.items():
            self._pass_on(name, rest)
        os.close(report_pipe)
        os.close(end_pipe)
        for stream in (process.stdout, process.stderr, process.stdin):
            with suppress(OSError):
                stream.close()
        with suppress(RuntimeError):  # the loop has ended: nothing waits
            self._loop.call_soon_threadsafe(self._end, code)

    def _end(self, code: int) -> None:
        if not self._ended.done():
            self._ended.set_result(code)

    def _read(self, pipe: int, name: str, pipes: selectors.BaseSelector) -> None:
        """Read a pipe until it is empty, and pass on whole lines."""
        while True:
            try:
                piece = os.read(pipe, _PIECE)
            except BlockingIOError:
                return
            if not piece:
                pipes.unregister(pipe)
                return
            *lines, rest = (self._rest[name] + piece).split(b"\n")
            for line in lines:
                self._pass_on(name, line)
            longest = _REPORT_BYTES if name == "report" else _LINE_BYTES
            if len(rest) > longest:
                self._pass_on(name, rest)
                rest = b""
            self._rest[name] = rest
            if len(piece) < _PIECE:
                return

    def _pass_on(self, name: str, line: bytes) -> None:
        if not line:
            return
        if name != "report":
            self._sink.on_print(line.decode(errors="backslashreplace"), error=name == "err")
            return
        with suppress(ValueError):  # half a line: the process was killed
            self._sink.on_message(json.loads(line))
