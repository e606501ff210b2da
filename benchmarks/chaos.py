"""Kills and stops the processes of a run at random, to see whether it survives: `python benchmarks/chaos.py`.

Three processes are attacked; each publishes 100 numbers a second to all others, asks their services, and has a
parameter set again and again. Two more, which nobody attacks, do the same between themselves. The seed decides who is
hit when, by what. What has to hold, whatever happens:

- the steady pair loses nothing (I1), and no one sees a number twice, or before an earlier one of the same life (I2);
- every line of the ledger balances (I3), and no queue is ever longer than its depth (I4);
- within five seconds of the last fault every process answers again (I11), with the parameters it was told last;
- afterwards the main process has the descriptors and Python threads it began with (I6), and once the run has ended no
  process, socket or directory of it is left (I5);
- the end of a process is told once, and the log stays readable (I7);
- every call ends in an answer or an error within its time, and those of the steady pair in an answer (I8);
- no process starts anew more often than its limit allows, and one that ran calmly for long pauses as at first (I9);
- a seed stands for one sequence of faults (I12; `schedule` is a function of it alone).

That recordings can be read up to where a process was killed, and agree with what was received (I10), is seen to by
`tests/processes/test_joint_recording.py`; that simulated runs of a seed are the same (I12) by the tests of simulations.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

VICTIMS = ("left", "middle", "right")
PATIENCE_S = 60.0
RECOVERY_S = 5.0
MOST, WINDOW_S, FIRST_S, LONGEST_S = 30, 10.0, 0.05, 0.5
RESTART = f"{{policy: always, max: {MOST}, window: {WINDOW_S}s, backoff: [{FIRST_S}s, {LONGEST_S}s]}}"
STOPPED_S, CALL_S, LATE_S, GRACE_S = 4.0, 1.0, 2.0, 0.75
"""How long a process may be stopped, the limit of a call, how long one may take with it, and nodes to stop."""
UNSURE_S = 0.5
"""How much later than it happened a line of the log may be written."""
LINES_PER_S = 100.0
UNDER_WAY = 2
"""Of the steady pair's numbers, a hundred a second, so many may be on their way when the run ends."""
PLUGIN = '''
import asyncio

from busflow import Node, Parameters, QoS, ServiceError, service, timer
from busflow.msgs.std_msgs import Int64MultiArray
from busflow.msgs.std_srvs import Trigger


class BeaterParameters(Parameters):
    hears: list[str] = []
    limit_s: float
    mark: int = 0


class Beater(Node):
    """Tells its life and a number, and watches that the numbers of others never go back within a life."""

    parameters: BeaterParameters

    def declare(self) -> None:
        self.beats = self.create_publisher(Int64MultiArray, f"{self.name}/beats")
        for name in self.parameters.hears:
            self.create_subscription(
                Int64MultiArray, f"{name}/beats", lambda beat, name=name: self.hear(name, beat), qos=QoS(depth=500)
            )
        self.others = [self.create_client(Trigger, f"{name}/ask") for name in self.parameters.hears]

    async def start(self) -> None:
        self.life, self.number, self.last = self.clock.now().nanoseconds, 0, {}

    @timer(hz=100)
    def beat(self) -> None:
        self.number += 1
        self.beats.publish(Int64MultiArray(data=[self.life, self.number]))

    @service(Trigger, "~/ask")
    def answer(self, request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)

    async def run(self) -> None:
        while True:
            await asyncio.sleep(0.05)
            for other in self.others:
                begun = self.clock.seconds()
                try:
                    await other.call(timeout=self.parameters.limit_s)
                except ServiceError:
                    pass
                if (took := self.clock.seconds() - begun) > 2 * self.parameters.limit_s:
                    self.log.error("late answer", service=other.service, took=took)

    def hear(self, name: str, beat: Int64MultiArray) -> None:
        life, number = beat.data.tolist()
        if number <= self.last.get((name, life), 0):
            self.log.error("out of order", publisher=name, life=life, number=number)
        self.last[name, life] = number
'''


@dataclass
class Outcome:
    """What a run under attack came to."""

    seed: int
    faults: Counter[str] = field(default_factory=Counter[str])
    schedule: str = ""
    restarts: int = 0
    recovery_s: float = 0.0
    published: int = 0
    received: int = 0
    lost: int = 0
    dropped: int = 0
    called: int = 0
    unanswered: int = 0
    marks: int = 0
    """Parameters that were set."""
    hang_seen_s: float = 0.0
    """The longest time from a process's being stopped to its being told of."""
    stop_s: float = 0.0
    broken: list[str] = field(default_factory=list[str])
    """The invariants that did not hold."""


class Run:
    """The run under attack, and what it logs."""

    def __init__(self, folder: Path, runtime: Path) -> None:
        environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": str(runtime)}
        command = [sys.executable, "-m", "busflow", "run", "chaos.yaml", "-v", "--log-format", "json"]
        self.process = subprocess.Popen(  # noqa: S603  # our own interpreter
            [*command, "--report", "report.json", "--watchdog", "off"],
            cwd=folder,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.pids: dict[str, int] = {}
        self.lines: list[dict[str, Any]] = []
        self.stopped_at: dict[str, float] = {}
        self.hang_seen_s = 0.0
        self.told: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None  # noqa: S101  # it is a pipe
        with self.process.stderr as lines:
            for text in lines:
                self._take(text)

    def _take(self, text: str) -> None:
        if not text.startswith("{"):
            self.told.append(text)
            return
        line = json.loads(text)
        self.lines.append(line)
        process = line["event"].removeprefix("the process ").partition(" ")[0]
        if line["event"].endswith("is started"):
            self.pids[process] = line["pid"]
        elif " hangs: " in line["event"] and process in self.stopped_at:
            self.hang_seen_s = max(self.hang_seen_s, time.perf_counter() - self.stopped_at[process])

    def those(self, *texts: str) -> list[dict[str, Any]]:
        """The lines of the log in whose event all these words are."""
        return [line for line in self.lines if all(text in line["event"] for text in texts)]

    def hit(self, process: str, number: int) -> bool:
        """Send a signal to a process; False when there is none just now."""
        try:
            os.kill(self.pids[process], number)
        except ProcessLookupError:
            return False
        return True

    def resources(self) -> tuple[int, int]:
        """Open descriptors and Python's threads of the main process.

        Zenoh's threads come when it has more to do, and end after ten seconds without work. It gives them names
        ("rx-0"); Python's have the name of the process.
        """
        own = Path(f"/proc/{self.process.pid}")
        names = [(thread / "comm").read_text() for thread in (own / "task").iterdir()]
        return len(list((own / "fd").iterdir())), names.count((own / "comm").read_text())

    def end(self) -> float:
        """Press Ctrl-C; how long it took to end."""
        began = time.perf_counter()
        self.process.send_signal(signal.SIGINT)
        self.process.wait(PATIENCE_S)
        took = time.perf_counter() - began
        self._reader.join(PATIENCE_S)
        return took


def launch_file(slowness: float) -> str:
    """The run: a process for each beater, the main one with a beater of its own."""
    lines = ["name: chaos", "plugins: [plugins]", f"shutdown: {{grace: {GRACE_S * slowness}s}}", "processes:"]
    lines += [f"  {name}:\n    restart: {RESTART}" for name in VICTIMS]
    lines += ["  calm:", "  steady:", "nodes:"]
    everybody = ("main", *VICTIMS)
    heard_by = {name: [other for other in everybody if other != name] for name in everybody}
    heard_by |= {"calm": ["steady"], "steady": ["calm"]}
    for name, heard in heard_by.items():
        hears = ", ".join(f"beater_{other}" for other in heard)
        parameters = f"{{limit_s: {CALL_S * slowness}, hears: [{hears}]}}"
        lines.append(f"  beater_{name}: {{plugin: beater, process: {name}, parameters: {parameters}}}")
    return "\n".join(lines) + "\n"


@contextmanager
def started(slowness: float) -> Iterator[tuple[Run, Path]]:
    """The run in a folder of its own, ended whatever happens."""
    with (
        tempfile.TemporaryDirectory(prefix="chaos") as folder,
        # The path of a socket must be short, which not every system's own folder for such files lets it be.
        tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as runtime,
    ):
        (Path(folder) / "plugins").mkdir()
        (Path(folder) / "plugins/beater.py").write_text(PLUGIN)
        (Path(folder) / "chaos.yaml").write_text(launch_file(slowness))
        os.environ["BUSFLOW_RUNTIME_DIR"] = runtime
        run = Run(Path(folder), Path(runtime))
        try:
            yield run, Path(folder)
        finally:
            if run.process.poll() is None:
                run.process.kill()
                run.process.wait()


def all_answer(within_s: float) -> float | None:
    """How long until every process of the run answers; None when one does not in time."""
    from busflow.wire.client.runs import ask_runs

    began = time.perf_counter()
    while (took := time.perf_counter() - began) < within_s:
        for present in ask_runs(0.5):
            states = Counter[str]()
            for process in present.processes:
                states.update(process["states"])
            if states == {"running": 6}:
                return took
        time.sleep(0.05)
    return None


Fault = tuple[float, str, str, float]
"""The pause before it, who is hit, by which signal, and how long one that is stopped stays so."""


def schedule(seed: int) -> Iterator[Fault]:
    """The faults of a seed, one after the other."""
    chance = random.Random(seed)  # it has to be the same every time
    while True:
        fault = chance.choice(["SIGKILL", "SIGKILL", "SIGSTOP", "SIGTERM", "SIGSEGV"])
        yield chance.uniform(0.2, 1.5), chance.choice(VICTIMS), fault, chance.uniform(0.1, STOPPED_S)


def attack(run: Run, outcome: Outcome, seconds: float, most: int | None) -> None:
    """Hit processes at random for a time, and no more than so many times; what is stopped goes on in the end."""
    digest = hashlib.sha256()
    end = time.perf_counter() + seconds
    for pause_s, process, fault, stopped_s in islice(schedule(outcome.seed), most):
        if time.perf_counter() > end:
            break
        time.sleep(pause_s)
        digest.update(f"{process} {fault} {stopped_s:.3f};".encode())
        if fault == "SIGSTOP":
            run.stopped_at[process] = time.perf_counter()
        if not run.hit(process, signal.Signals[fault]):
            continue
        outcome.faults[fault] += 1
        if fault == "SIGSTOP":
            stopped = run.pids[process]
            time.sleep(stopped_s)
            if run.pids[process] == stopped:
                run.hit(process, signal.SIGCONT)
    outcome.schedule = digest.hexdigest()[:12]


class Meddler:
    """Sets parameters all the time, and looks into queues."""

    def __init__(self, outcome: Outcome) -> None:
        self._outcome, self._over = outcome, threading.Event()
        self.possible: dict[str, set[int]] = {f"/beater_{name}": {0} for name in (*VICTIMS, "calm")}
        """What each node's mark may be: what was set last, and what was asked for without an answer since."""
        self._thread = threading.Thread(target=self._meddle, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Leave the run alone."""
        self._over.set()
        self._thread.join(PATIENCE_S)

    def _meddle(self) -> None:
        from busflow.wire.client.client import join

        mark = 0
        with join(patience_s=1.0) as peer:
            while not self._over.wait(0.3):
                mark += 1
                for node, possible in self.possible.items():
                    self._set(peer, node, mark, possible)
                self._look(peer)

    def _set(self, peer: Any, node: str, mark: int, possible: set[int]) -> None:
        from busflow.errors import BusflowError

        possible.add(mark)
        with suppress(BusflowError):  # it is dead, or between two lives
            (answer,) = peer.ask("set_parameters", node=node, values={"mark": mark})
            if [change["new"] for change in answer["changed"]] == [mark]:
                possible.intersection_update({mark})
                self._outcome.marks += 1

    def _look(self, peer: Any) -> None:
        from busflow.errors import BusflowError

        with suppress(BusflowError):
            for report in peer.ask("report"):
                for topic in report["topics"]:
                    for line in topic["subscriptions"]:
                        if line["queued"] > line["depth"]:
                            self._outcome.broken.append(f"I4: {line['node']} has {line['queued']} of {topic['name']}")

    def check(self, within_s: float) -> None:
        """Whether every node has what it was told last, however often its process died since."""
        from busflow.wire.client.client import join

        told: dict[str, Any] = {}
        end = time.perf_counter() + within_s
        with join(patience_s=RECOVERY_S) as peer:
            # One that was told to end last of all may have answered for the last time when all answered.
            while not told.keys() >= self.possible.keys() and time.perf_counter() < end:
                told = {node: values for answer in peer.ask("parameters") for node, values in answer.items()}
        for node, possible in self.possible.items():
            if node not in told:
                self._outcome.broken.append(f"parameters: {node} does not answer")
                continue
            (mark,) = [each["value"] for each in told[node] if each["name"] == "mark"]
            if mark not in possible:
                self._outcome.broken.append(f"parameters: the mark of {node} is {mark}, and was set to {possible}")


def judge(run: Run, folder: Path, outcome: Outcome, slowness: float) -> None:
    """Look at what the run came to."""
    report = json.loads((folder / "report.json").read_text())
    outcome.restarts = sum(each["restarts"] for each in report["processes"])
    outcome.published = sum(topic["published"] for topic in report["topics"])
    outcome.lost = sum(topic["losses"].get("lost", 0) for topic in report["topics"])
    for topic in report["topics"]:
        for line in topic["subscriptions"]:
            outcome.received += line["delivered"]
            outcome.dropped += line["dropped"]
            if line["published"] != line["delivered"] + line["dropped"] + line["queued"]:
                outcome.broken.append(f"I3: the account of {line['node']} on {topic['name']} does not balance")
        if topic["name"] in {"/beater_calm/beats", "/beater_steady/beats"}:
            (line,) = topic["subscriptions"]
            under_way = topic["published"] - line["delivered"]
            if under_way > UNDER_WAY * slowness or topic["losses"]:
                outcome.broken.append(
                    f"I1: {topic['name']}: {topic['published']} published, {line['delivered']} delivered"
                )
    if found := run.those("out of order"):
        outcome.broken.append(f"I2: {len(found)} out of order, first {found[0]}")
    judge_log(run, report, outcome)
    judge_calls(run, report, outcome, slowness)
    judge_restarts(run, outcome, slowness)


def judge_log(run: Run, report: dict[str, Any], outcome: Outcome) -> None:
    """Whether what went wrong is told, once, and not drowned."""
    fates = sum(len(each["fates"]) for each in report["processes"])
    told = run.those("the process", "was ended by") + run.those("the process", "ended with exit code")
    if len(told) != fates:
        outcome.broken.append(f"I7: {fates} processes died, and {len(told)} deaths are told")
    if len(run.lines) > LINES_PER_S * max(report["duration_s"], 1.0):
        outcome.broken.append(f"I7: {len(run.lines)} lines in {report['duration_s']:.0f} s")


def judge_calls(run: Run, report: dict[str, Any], outcome: Outcome, slowness: float) -> None:
    """Whether every call has ended, in time."""
    for service in report["services"]:
        for line in service["clients"]:
            outcome.called += line["called"]
            outcome.unanswered += line["called"] - line["answered"]
            if line["called"] != line["answered"] + line["failed"] + line["cancelled"] + line["waiting"]:
                outcome.broken.append(f"I8: the calls of {line['node']} to {service['name']} do not add up")
            steady = {"/beater_calm", "/beater_steady"}
            if line["node"] in steady and line["called"] - line["answered"] > 1:  # one may be on its way at the end
                outcome.broken.append(f"I8: {line['node']} called {line['called']}, answered {line['answered']}")
    # One that was stopped itself has waited meanwhile, by the time of the machine.
    late_s = LATE_S * slowness
    allowed_s = dict.fromkeys([f"/beater_{name}" for name in VICTIMS], late_s + STOPPED_S)
    if found := [line for line in run.those("late answer") if line["took"] > allowed_s.get(line["node"], late_s)]:
        outcome.broken.append(f"I8: {len(found)} answers came late, first {found[0]}")


def judge_restarts(run: Run, outcome: Outcome, slowness: float) -> None:
    """Whether the limit of restarts and their pauses are what was asked for."""
    for name in VICTIMS:
        moments: list[float] = []
        runs_since: float | None = None
        row = 0
        for line in run.those(f"the process {name} "):
            moment, event = line["stamp_ns"] / 1e9, line["event"]
            if event.endswith(" runs"):
                runs_since = moment
            elif " restarts in " in event:
                lived_s, runs_since = 0.0 if runs_since is None else moment - runs_since, None
                row = 0 if lived_s >= WINDOW_S else row
                pause_s, expected_s = float(event.split()[-2]), min(LONGEST_S, FIRST_S * 2**row)
                if pause_s != expected_s and abs(lived_s - WINDOW_S) > UNSURE_S * slowness:
                    outcome.broken.append(
                        f"I9: {name} paused for {pause_s:g} s, not {expected_s:g}, having lived {lived_s:.1f} s"
                    )
                row = 1 if pause_s == FIRST_S else row + 1
                moments.append(moment)
        if any(last - first < WINDOW_S for first, last in zip(moments, moments[MOST:], strict=False)):
            outcome.broken.append(f"I9: {name} started anew more than {MOST} times within {WINDOW_S:g} s")


def chaos(seconds: float, seed: int, *, most: int | None = None, slowness: float = 1.0) -> Outcome:
    """Attack a run for so long, with `most` faults, and return the outcome; `slowness` multiplies all its limits."""
    outcome, allowed_s = Outcome(seed), RECOVERY_S * slowness
    with started(slowness) as (run, folder):
        if all_answer(PATIENCE_S) is None:
            outcome.broken.append(f"it did not start: {''.join(run.told)}")
            return outcome
        before = run.resources()
        meddler = Meddler(outcome)
        attack(run, outcome, seconds, most)
        meddler.end()
        recovery_s = all_answer(PATIENCE_S)
        if recovery_s is None or recovery_s > allowed_s:
            outcome.broken.append(f"I11: not everything ran again within {allowed_s:g} s, but after {recovery_s} s")
        outcome.recovery_s = recovery_s or PATIENCE_S
        outcome.hang_seen_s = run.hang_seen_s
        if recovery_s is not None:
            meddler.check(allowed_s)
        after = run.resources()
        if after[0] > before[0] + 2 or after[1] > before[1] + 2:
            outcome.broken.append(f"I6: descriptors and Python threads were {before}, and are {after}")
        outcome.stop_s = run.end()
        judge(run, folder, outcome, slowness)
        if run.process.returncode != 128 + signal.SIGINT:
            outcome.broken.append(f"it ended with {run.process.returncode}: {''.join(run.told)}")
        left = [name for name, pid in run.pids.items() if Path(f"/proc/{pid}").exists()]
        left += [path.name for path in Path(os.environ["BUSFLOW_RUNTIME_DIR"]).iterdir() if path.name != ".lock"]
        if left:
            outcome.broken.append(f"I5: left over: {left}")
    return outcome


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--for", dest="seconds", type=float, default=300.0, help="How many seconds; 300 unless said.")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    outcome = chaos(given.seconds, given.seed)
    print(f"seed {outcome.seed}, schedule {outcome.schedule}: {dict(outcome.faults)}, {outcome.restarts} restarts")
    print(f"{outcome.published} published; {outcome.received} received, {outcome.lost} lost, {outcome.dropped} dropped")
    print(f"{outcome.called} calls, {outcome.unanswered} of them without an answer; {outcome.marks} parameters set")
    print(f"a stopped process was told of after {outcome.hang_seen_s:.2f} s at most (0: none was stopped for so long)")
    print(f"all ran again after {outcome.recovery_s:.1f} s; Ctrl-C took {outcome.stop_s:.2f} s")
    for broken in outcome.broken:
        print(f"BROKEN {broken}")
    return 1 if outcome.broken else 0


if __name__ == "__main__":
    sys.exit(main())
