"""A real process, from its start to its end, and what it says meanwhile."""

import asyncio
import os
import signal
import sys

from busflow.processes.child import Child

PYTHON = (sys.executable, "-P", "-m")


class ListRecorder:
    def __init__(self):
        self.messages, self.printed = [], []

    def on_message(self, message):
        self.messages.append(message)

    def on_print(self, line, *, error):
        self.printed.append((line, error))


def lived(*arguments, first_line=b"", act=None):
    """The code with which a process ended, and what it reported."""
    listener = ListRecorder()

    async def main():
        async with asyncio.timeout(60):
            child = Child([*PYTHON, *arguments], os.environ, lambda: first_line, listener)
            if act is not None:
                act(child)
            return await child.ended()

    return asyncio.run(main()), listener


def test_output_and_ending_are_reported():
    code, listener = lived("busflow", "--no-such-option")
    assert code == 2
    assert any("--no-such-option" in line and error for line, error in listener.printed)


def test_killed_process_reports_its_signal():
    assert lived("busflow", "ps", act=Child.kill)[0] == -signal.SIGKILL


def test_malformed_first_line_is_reported():
    code, listener = lived("busflow.processes.worker", "left", first_line=b"nonsense\n")
    assert (code, len(listener.printed)) == (1, 1), "an error in one line, without a traceback"
    assert listener.messages == []
