"""Timeouts: every limit of real time at which busflow gives up, warns or ends something by force.

Code reads a limit at the moment it needs it, e.g. `timeouts.current.grace`; a test puts another object there. Limits
that a user states in a launch file or in a call, and times of the run's clock, are not here.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import NamedTuple, TypeVar

from busflow.errors import InvalidInput, Problem
from busflow.text import did_you_mean, printable

VARIABLE = "BUSFLOW_TIMEOUTS"
"""The environment variable that sets some of them in tests: `BUSFLOW_TIMEOUTS='import_warning=inf,grace=20'`."""
_LONGEST = 86_400.0
"""The limit that stands for infinity: not every wait of a thread takes infinity, and no test lasts a day."""

Limits = TypeVar("Limits", bound=NamedTuple)


class Timeouts(NamedTuple):  # a dataclass of so many fields takes 2 ms to make, at each start
    """Limits in seconds of real time; one of infinity lasts a day."""

    # Nodes of a run
    import_warning: float = 5.0
    """Import of a plugin before standard error names its line: some libraries take twenty seconds."""
    start: float = 10.0
    """A node's `start`, and its `stop` before a restart or by hand."""
    waiting_warning: float = 10.0
    """Wait of a node for another one before the log warns."""
    thread_call: float = 5.0
    """Wait of a thread until the loop has called its function."""
    loop_answer: float = 0.4
    """Time within which a loop that turns calls a function, also on a busy machine."""
    unawaited: float = 0.1
    """Wait of a task that failed for being awaited, before the log warns; by the time of the loop."""
    stuck_warning: float = 5.0
    """Call of a handler on virtual time, which stands still for it, before the log warns."""
    foreign_threads: float = 0.05
    """Wait for threads that the virtual loop did not start, when nothing else can go on."""
    idle_sockets: float = 1.0
    """Wait of the virtual loop for sockets and pipes, when nothing else can go on."""
    run_thread: float = 60.0
    """Call in a worker thread on virtual time, in a run or a replay: its nodes may compute longer than in a test."""

    # The end of a run
    grace: float = 0.75
    """Stop of all nodes together, after Ctrl-C too; a launch file's `shutdown: {grace: …}` changes it."""
    last_resort: float = 0.1
    """Time that a node that was given up has to end once cancelled, and again once its tasks are."""
    around: float = 2.0
    """Time beyond the grace in which a run that makes progress ends its nodes and its session, on a busy machine."""
    child_exit: float = 0.5
    """End of the processes that nodes have started, after SIGTERM at the end of a run."""
    last_act: float = 5.0
    """Last act before the process is ended by force: the machine may be busy, and a disk may hang."""
    repeated_signal: float = 0.1
    """Time in which the same signal again is the first one: `timeout` sends its own to a program and to its group."""
    last_messages: float = 0.5
    """Sending of the messages that were published last, by each thread, where a reader has stopped."""
    overtaken: float = 0.05
    """Time for large messages that Zenoh has accepted to leave. Its word that a session ends overtakes up to a megabyte
    of them, and nothing says whether any are left (measured: one in five of the last messages was lost without this).
    """
    sender_end: float = 5.0
    """End of the thread that sends messages to other processes."""
    inlet_end: float = 5.0
    """End of the thread that receives messages of other processes."""
    bridge_end: float = 3.0
    """End of a bridge to DDS before it is killed."""
    participant_end: float = 5.0
    """End of the thread that reads from DDS."""

    # Recordings
    recording_end: float = 5.0
    """End of a recording: 64 MiB, the most that wait to be written, at 16 MB/s, as on an SD card, take four seconds.

    A process that waits for a run's end, or ends it by force, allows this time beyond the nodes' grace.
    """
    snapshot_end: float = 60.0
    """End of a snapshot's file: a GiB at 16 MB/s, as on an SD card, takes a minute."""
    snapshot_order: float = 1.0
    """Wait of a process that ends after a failure for the order to write its snapshot."""

    # Processes, machines and programs of a run
    processes_start: float = 60.0
    """Time for all processes to get ready: some load a gigabyte before they build a node."""
    processes_warning: float = 10.0
    """Part of it after which the log names the processes that are not ready."""
    process_kill: float = 0.2
    """Time until a process is killed, beyond the end of its nodes and its recording and the time `around` them.

    It has ended itself by then, unless it is stopped or in a call that keeps its other threads waiting.
    """
    last_reports: float = 0.3
    """Reading of the last reports after the processes have been killed."""
    pipe_end: float = 0.3
    """Time by which a slow main process may delay the end of a worker process."""
    process_exit: float = 0.2
    """Time from the loss of a token to the check whether the process hangs.

    An ending process loses its token first, and its exit is known a moment later.
    """
    process_silent: float = 1.0
    """Time without a message after which a process counts as hanging; a working one reports twice in it."""
    machine_missing: float = 2.0
    """Time that a machine may take before the log says that it is missing."""
    machine_older: float = 0.5
    """Least time of a link to another machine with which this run counts as older than another run of this machine."""
    machine_double: float = 3.0
    """Time after which another run with this machine's name counts: the token of a killed run disappears sooner."""
    machine_probe: float = 2.0
    """Connection to a machine that is missing, and its handshake."""
    machine_alert: float = 0.5
    """Wait for a machine to refuse our certificate, which it does after the handshake."""
    router: float = 2.0
    """Answer of a router of ROS 2."""
    program_end: float = 1.5
    """Time beyond the graces of a program that killed processes, its keeper and the reading of its output may take."""

    # Links between processes
    lease: float = 1.6
    """Time after which a hanging process counts as gone; it has to be reported within two seconds. Zenoh sends four
    keep-alives in this time, from threads that need neither the event loop nor the interpreter's lock.
    """
    busy_loop: float = 0.1
    """Time after which a loop that has not emptied its buffer counts as busy: the buffer is then limited in bytes too.
    """
    newer_messages: float = 0.0005
    """Wait for newer messages of another process, after its oldest ones have waited here for a busy loop."""
    departure: float = 0.05
    """Wait before a publisher is removed after its token's end: its last messages may still be in the buffer."""
    held_messages: float = 1.0
    """Answer of a process whose loop is blocked, when it is asked for the messages that it holds back."""
    kept_messages: float = 2.0
    """Answer of publishers to a late joiner, which then gets the kept messages that have arrived by then."""

    late_feedback: float = 0.2
    """Wait after a goal's result for the next feedback before it, which takes another way between processes; by the
    run's clock.
    """

    # Commands on a run
    answer: float = 5.0
    """Answer of a run to a command."""
    present: float = 1.0
    """Answer of a run to a list of runs. An idle run needs a millisecond; a list must not wait for a hanging one."""
    completion: float = 0.5
    """Completion of a word in the shell, which a run that hangs must not block."""
    settled: float = 2.0
    """Wait of a client that is going to publish for a process whose loop is blocked."""
    latched: float = 2.0
    """Wait of a client for the states of goals that a server keeps."""
    node_order: float = 60.0
    """Wait of `busflow node stop`, `start` and `restart` for the node."""

    def but(self, **limits: float) -> Timeouts:
        """Return the same limits with others for some names; infinity becomes a day."""
        return _replaced(self, limits)

    def changed(self) -> dict[str, float]:
        """Return the limits that differ from the defaults, with which `Timeouts(**changed)` is the same."""
        defaults = Timeouts()._asdict()
        return {name: limit for name, limit in self._asdict().items() if limit != defaults[name]}


def stated(text: str, defaults: Limits, variable: str = VARIABLE) -> Limits:
    """Return the defaults, e.g. `Timeouts()`, with the limits of a text such as `import_warning=inf,grace=20`.

    Raises:
        InvalidInput: A name is unknown, or a limit is not a number of seconds from 0 to infinity.
    """
    limits: dict[str, float] = {}
    for part in filter(str.strip, text.split(",")):
        name, _, value = (word.strip() for word in part.partition("="))
        if name not in defaults._fields:
            fix = did_you_mean(name, defaults._fields)
            raise _refused(variable, f"no limit is named {printable(repr(name), limit=60)}", fix)
        try:
            limits[name] = float(value)
        except ValueError:
            limits[name] = -1.0
        if not limits[name] >= 0:  # nor is it NaN
            got = printable(repr(value), limit=60)
            why = f"{name} must be a number of seconds from 0 to inf, got {got}"
            raise _refused(variable, why, f"write {name}=20")
    return _replaced(defaults, limits)


def _replaced(limits: Limits, others: Mapping[str, float]) -> Limits:
    return limits._replace(**{name: min(limit, _LONGEST) for name, limit in others.items()})


def _refused(variable: str, why: str, fix: str) -> InvalidInput:
    return InvalidInput(Problem("timeouts", f"{variable}: {why}", fix))


current: Timeouts = stated(os.environ.get(VARIABLE, ""), Timeouts())
"""The limits of this process; a worker process has the same limits as the process that started it."""
