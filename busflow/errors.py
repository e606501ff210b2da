"""All exceptions of busflow, subclasses of `BusflowError`, and `Problem`: one mistake in a file.

A message says what is wrong, where, why, and what to do. Problems are collected, not raised one at a time, so that a
launch file shows all its mistakes in one report.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import IntEnum, StrEnum
from typing import TypeAlias

from busflow.text import printable

KeyPath: TypeAlias = tuple[str | int, ...]
"""The path to a value in nested data: keys of mappings and indices of lists."""


class ExitCode(IntEnum):
    """The exit codes of the `busflow` command."""

    OK = 0
    FAILED = 1  # a node or an expectation failed
    USAGE = 2  # wrong usage, or a file that cannot run
    DIFFERENT = 3  # `check` or `diff` found something
    NOT_FOUND = 4  # no such run or target
    INCOMPLETE = 5  # messages dropped, or a recording incomplete, where that was forbidden
    HUNG_UP = 129  # SIGHUP: the terminal is gone
    INTERRUPTED = 130  # Ctrl-C
    TERMINATED = 143  # SIGTERM


class BusflowError(Exception):
    """Base of all exceptions of busflow."""

    code: str = "busflow-error"
    """A stable word for scripts, in kebab-case: the class's name, or the code of the one problem that it carries."""
    exit_code = ExitCode.FAILED
    place: Place | None = None
    """The line of the user's code at fault, if it is not the line that raised."""

    def __init_subclass__(cls) -> None:
        """Name the code after the class, unless the class states its own.

        >>> InvalidName.code, IncompatibleQoS.code
        ('invalid-name', 'incompatible-qos')
        """
        super().__init_subclass__()
        if "code" not in vars(cls):
            cls.code = re.sub("(?<=[a-z])(?=[A-Z][a-z])", "-", cls.__name__).lower()

    def as_json(self) -> dict[str, object]:
        """Return the error in the form that `--json` prints."""
        return {"code": self.code, "message": str(self)}


class InvalidName(BusflowError, ValueError):
    """A topic, node, namespace, package or remap name breaks ROS 2's grammar."""

    exit_code = ExitCode.USAGE


class InvalidDeclaration(BusflowError, TypeError):
    """A node or message class declares something that cannot work; raised when the class is created."""


InvalidQoS = InvalidDeclaration
"""A name of 0.1.0, which is gone in 0.2: a wrong profile is a wrong declaration."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One invalid value: its path, the reason, and a fix."""

    path: KeyPath
    message: str
    fix: str | None = None
    code: str = "invalid"
    """A stable word: unknown, missing, type, range, choice, length, read-only or invalid."""


class _WithFaults(BusflowError, ValueError):
    """Values are invalid; the error lists all their faults."""

    def __init__(self, faults: Sequence[Fault], subject: str = "") -> None:
        self.faults: tuple[Fault, ...] = tuple(faults)
        super().__init__(subject + "; ".join(_sentence(fault) for fault in self.faults))

    def as_json(self) -> dict[str, object]:
        return super().as_json() | {"faults": [asdict(fault) for fault in self.faults]}


class InvalidParameter(_WithFaults):
    """Parameters of a node are invalid; the error lists all their faults."""


class InvalidMessage(_WithFaults):
    """Field values of a message are invalid; the error lists all their faults.

    >>> str(InvalidMessage("Vector3", [Fault(("v",), "unknown field v", "did you mean 'x'?")]))
    "Vector3: unknown field v (did you mean 'x'?)"
    """

    def __init__(self, message: str, faults: Sequence[Fault]) -> None:
        super().__init__(faults, f"{message}: ")


class UnknownType(BusflowError, LookupError):
    """No message or service type has this name."""

    exit_code = ExitCode.USAGE


class IncompatibleType(BusflowError, TypeError):
    """Two endpoints of one topic, or a message and its topic, are of different types."""


class IncompatibleQoS(BusflowError, ValueError):
    """A publisher offers less than a subscription of its topic requests."""


class MalformedMessage(BusflowError, ValueError):
    """Bytes from outside do not match their type, or a value cannot be encoded.

    >>> str(MalformedMessage("no room", type_name="a/msg/B", path=("points", 3, "x"), offset=20))
    'a/msg/B: points[3].x at byte 20: no room'
    """

    def __init__(self, reason: str, *, type_name: str = "", path: KeyPath = (), offset: int | None = None) -> None:
        self.reason: str = reason
        self.type_name: str = type_name
        self.path: tuple[str | int, ...] = path
        self.offset: int | None = offset
        """The reason, the type, the path in its value, and the byte offset including the header, if known."""
        field = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).removeprefix(".")
        where = " ".join(part for part in (field, "" if offset is None else f"at byte {offset}") if part)
        super().__init__(printable(": ".join(part for part in (type_name, where, reason) if part)))


class InspectionUnavailable(BusflowError, RuntimeError):
    """A run cannot be inspected: no safe directory, no Zenoh, or no answer."""


class RunEnded(InspectionUnavailable):
    """A run ended while something of it was awaited."""


class BagError(BusflowError, ValueError):
    """A recording cannot be read, or only up to some offset.

    >>> str(BagError("a chunk is damaged", file="run.mcap", offset=20, fix="recover it"))
    'run.mcap: at byte 20: a chunk is damaged; recover it'
    """

    exit_code = ExitCode.USAGE

    def __init__(self, reason: str, *, file: str = "", offset: int | None = None, fix: str | None = None) -> None:
        self.reason: str = reason
        self.file: str = file
        self.offset: int | None = offset
        self.fix: str | None = fix
        where = [file, "" if offset is None else f"at byte {offset}"]
        text = ": ".join(part for part in (*where, reason) if part)
        super().__init__(printable(f"{text}; {fix}" if fix else text))


class NoSuchRun(BusflowError, LookupError):
    """No run of this name is on this machine, or several are and none was chosen."""

    exit_code = ExitCode.NOT_FOUND


class NotAllowed(BusflowError, PermissionError):
    """A session that joined a run on other machines may only read."""


class NoSuchTarget(BusflowError, LookupError):
    """The run has no node, topic, service or parameter of this name."""

    exit_code = ExitCode.NOT_FOUND


class NotRunning(BusflowError, RuntimeError):
    """A node, endpoint or graph was used before it was started or after it stopped."""


class WouldBlock(BusflowError):
    """A `publish` would have to wait for a subscription whose queue is full; no subscription received the message."""


class SendTimeout(WouldBlock, TimeoutError):
    """A `send` waited for room as long as the subscription allows; no subscription received the message."""


class Occupied(BusflowError, RuntimeError):
    """A task pulls from a subscription whose messages go to its handler or to another task."""


class ServiceError(BusflowError):
    """A call of a service got no answer."""


class ServiceUnavailable(ServiceError):
    """The service has no server, or its server has no room for another request."""


class ServiceGone(ServiceError):
    """The server's node ended before it had answered."""


class ServiceFailed(ServiceError):
    """The server's handler raised; the message carries its text, and its own node logs the details."""


class ServiceTimeout(ServiceError, TimeoutError):
    """There was no answer in time."""


class ActionError(BusflowError):
    """A goal of an action did not succeed."""


class ActionUnavailable(ActionError):
    """The action has no server, or its server has no room for another request."""


class ActionGone(ActionError):
    """The server's node ended before the goal had, or it knows nothing of the goal any more."""


class GoalRejected(ActionError):
    """The server does not take the goal; the message has its reason."""


class GoalAborted(ActionError):
    """The server gave the goal up: its handler raised, or another goal has replaced this one."""

    result: object | None = None
    """The `Result` that the server sent."""


class GoalCanceled(ActionError):
    """The goal was canceled."""

    result: object | None = None
    """The `Result` that the server sent."""


class GoalTimeout(ActionError, TimeoutError):
    """The goal did not end in time; it is canceled."""


class DeadlockError(BusflowError, RuntimeError):
    """A call would wait for a server that waits for its caller; the message names the chain.

    It is not a `ServiceError`: a retry does not help, the nodes must be changed.
    """


class DuplicateServer(BusflowError, ValueError):
    """A second server was declared for a service."""


class TransformError(BusflowError, LookupError):
    """There is no transform between two frames, or none at the time that was asked for."""


class UnknownFrame(TransformError):
    """No transform names the frame; the error has the nearest name."""


class FramesNotConnected(TransformError):
    """Two frames belong to trees apart; the error names both roots."""


class TransformTooOld(TransformError):
    """The time lies before the transforms that are kept: no wait brings it."""


class TransformNotThere(TransformError):
    """The transform at this time has not come yet; the error names the edge that lags, and by how much."""


class InvalidTransform(BusflowError, ValueError):
    """A transform cannot be part of the tree of frames: its numbers, a loop, or a second parent."""


class RecordingRefused(BusflowError, ValueError):
    """A recording cannot be made: its file exists already, or cannot be created."""

    exit_code = ExitCode.USAGE


class IncompleteRecording(BusflowError):
    """A recording that had to be complete lacks messages of the run."""

    exit_code = ExitCode.INCOMPLETE


class NodeFailed(BusflowError):
    """A node raised; the cause is chained."""


class Stray(BusflowError):
    """A task or a callback of a run failed, and its node is unknown; the cause is chained."""


class StopTimeout(BusflowError, TimeoutError):
    """A node's `stop` took too long."""


class RestartLimit(BusflowError):
    """A node was restarted as often as its launch file allows within some time."""


class DependencyEnded(BusflowError):
    """A node waits for a condition of another node, which ended before it was met."""


class ProcessFailed(BusflowError):
    """A process of a run could not be started, did not become ready, or ended too early."""


class ProgramFailed(BusflowError):
    """A program of a run could not be started, or failed and is not restarted."""


class CertificateError(BusflowError):
    """A certificate cannot be made."""

    exit_code = ExitCode.USAGE


class StartTimeout(BusflowError, TimeoutError):
    """A node's `start` did not return in time."""


class NotSeen(BusflowError, AssertionError):
    """A condition that a test waited for was not met; the message says what was seen instead."""


class ReplayDiffers(BusflowError, AssertionError):
    """Nodes replayed on a recording did not publish the recorded messages."""

    exit_code = ExitCode.DIFFERENT


class Deadlock(BusflowError):
    """In virtual time, no event is left that could wake the waiting tasks; the message names them."""


class _WithProblem(BusflowError):
    """One problem, as an error that has its code."""

    exit_code = ExitCode.USAGE

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.code: str = problem.code
        super().__init__(problem.render())

    def as_json(self) -> dict[str, object]:
        return self.problem.as_json()


class PluginError(_WithProblem):
    """A plugin or an installed command cannot be found or imported; `problem.place` is its line of code at fault."""


class InvalidInput(_WithProblem, ValueError):
    """A command-line value for a running graph is invalid; `problem.place` is the part at fault."""


class Severity(StrEnum):
    """The severity of a problem: an error stops the start, a warning does not, info is shown with `-v`."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


@dataclass(frozen=True, slots=True)
class Place:
    """The position of a problem: a range in one line of a file. Line and column count from 1."""

    file: str
    line: int
    column: int
    width: int = 1
    excerpt: str = ""

    def __str__(self) -> str:
        return f"{printable(self.file)}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Problem:
    """One mistake in a file: the reason, the place, and a fix."""

    code: str
    """A stable word for scripts, in kebab-case: `unknown-parameter`."""
    message: str
    fix: str | None = None
    place: Place | None = None
    severity: Severity = Severity.ERROR
    included_from: tuple[Place, ...] = ()
    """The `include` entries, or the imports and the `plugin:`, that led to the file, innermost first."""
    details: tuple[str, ...] = ()
    """Lines that show it, such as those of a diff."""

    def render(self) -> str:
        """Return the problem as text for people: `file:line:col: error: …`, the line, a caret, the fix."""
        where = f"{self.place}: " if self.place else ""
        lines = [f"{where}{self.severity}: {printable(self.message)}"]
        if self.place and self.place.excerpt:
            lines += _excerpt(self.place)
        lines += [f"  {printable(each)}" for each in self.details]
        if self.fix:
            lines.append(f"  {'' if self.fix.startswith('known: ') else 'fix: '}{printable(self.fix)}")
        how = "used by" if self.place is not None and self.place.file.endswith(".py") else "included from"
        lines += [f"  {how} {place}" for place in self.included_from]
        return "\n".join(lines)

    def as_json(self) -> dict[str, object]:
        """Return the problem in the form that `--json` prints."""
        place = self.place
        return {
            "code": self.code,
            "severity": self.severity.value,
            "message": printable(self.message),
            "fix": None if self.fix is None else printable(self.fix),
            "file": place.file if place else None,
            "line": place.line if place else None,
            "column": place.column if place else None,
            "included_from": [str(each) for each in self.included_from],
            "details": [printable(each) for each in self.details],
        }


class _WithProblems(BusflowError):
    """Files are invalid; the error lists all their problems."""

    exit_code = ExitCode.USAGE

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems: tuple[Problem, ...] = tuple(problems)
        super().__init__("\n".join(problem.render() for problem in self.problems))

    def as_json(self) -> dict[str, object]:
        return super().as_json() | {"problems": [problem.as_json() for problem in self.problems]}


class LaunchError(_WithProblems):
    """A launch description cannot run; the error lists all its problems."""


class InvalidDefinition(_WithProblems, ValueError):
    """Files that define messages, services or actions are invalid; the error lists all their problems."""


IN_A_CLONE = {"busflow": ".", "busflow-assistant": "./assistant", "busflow-ui": "./ui"}
"""Where pip finds the distributions of this project. It is emptied when they are published: names are enough then."""


def how_to_install(*wanted: str) -> str:
    """Return the command that installs distributions of this project, each with its extras.

    >>> how_to_install("busflow[top]"), how_to_install("busflow", "busflow-ui")
    ("in a clone of busflow: pip install '.[top]'", 'in a clone of busflow: pip install . ./ui')
    """
    import shlex

    parts = [re.sub(r"^[\w-]+", lambda name: IN_A_CLONE.get(name[0], name[0]), each) for each in wanted]
    return f"{'in a clone of busflow: ' if IN_A_CLONE else ''}pip install {shlex.join(parts)}"


def _sentence(fault: Fault) -> str:
    return printable(f"{fault.message} ({fault.fix})" if fault.fix else fault.message)


def _excerpt(place: Place) -> list[str]:
    """Return the line with a caret under the place; a long line is cut around it."""
    start = max(0, place.column - 81)
    shown = printable(place.excerpt[start : start + 160])
    offset = len(printable(place.excerpt[start : place.column - 1]))
    width = max(1, min(place.width, len(shown) - offset))
    return [f"  {shown}", f"  {' ' * offset}{'^' * width}"]
