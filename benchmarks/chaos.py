"""Kills and stops the processes of a run at random, to see whether it survives: `python benchmarks/chaos.py`.

Three processes are attacked; each publishes 100 numbers a second to all others. Two more, which nobody attacks, do the
same between themselves. The seed decides who is hit when, by what. What has to hold, whatever happens:

- the steady pair loses nothing (I1), and no one sees a number twice, or before an earlier one of the same life (I2);
- every line of the ledger balances (I3);
- within five seconds of the last fault every process answers again (I11);
- afterwards the main process has the descriptors and threads it began with (I6), and once the run has ended no process,
  socket or directory of it is left (I5).
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
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

VICTIMS = ("left", "middle", "right")
PATIENCE_S = 60.0
RECOVERY_S = 5.0
PLUGIN = '''
from busflow import Node, Parameters, QoS, timer
from busflow.msgs.std_msgs import Int64MultiArray


class BeaterParameters(Parameters):
    hears: list[str] = []


class Beater(Node):
    """Tells its life and a number, and watches that the numbers of others never go back within a life."""

    parameters: BeaterParameters

    def declare(self) -> None:
        self.beats = self.create_publisher(Int64MultiArray, f"{self.name}/beats")
        for name in self.parameters.hears:
            self.create_subscription(
                Int64MultiArray, f"{name}/beats", lambda beat, name=name: self.hear(name, beat), qos=QoS(depth=500)
            )

    async def start(self) -> None:
        self.life, self.number, self.last = self.clock.now().nanoseconds, 0, {}

    @timer(hz=100)
    def beat(self) -> None:
        self.number += 1
        self.beats.publish(Int64MultiArray(data=[self.life, self.number]))

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
        self.out_of_order: list[dict[str, Any]] = []
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
        if line["event"].endswith("is started"):
            self.pids[line["event"].split()[2]] = line["pid"]
        elif line["event"] == "out of order":
            self.out_of_order.append(line)

    def hit(self, process: str, number: int) -> bool:
        """Send a signal to a process; False when there is none just now."""
        try:
            os.kill(self.pids[process], number)
        except ProcessLookupError:
            return False
        return True

    def resources(self) -> tuple[int, int]:
        """Open descriptors and threads of the main process."""
        own = Path(f"/proc/{self.process.pid}")
        return len(list((own / "fd").iterdir())), len(list((own / "task").iterdir()))

    def end(self) -> float:
        """Press Ctrl-C; how long it took to end."""
        began = time.perf_counter()
        self.process.send_signal(signal.SIGINT)
        self.process.wait(PATIENCE_S)
        took = time.perf_counter() - began
        self._reader.join(PATIENCE_S)
        return took


def launch_file() -> str:
    """The run: a process for each beater, the main one with a beater of its own."""
    lines = ["name: chaos", "plugins: [plugins]", "processes:"]
    lines += [f"  {name}:\n    restart: {{policy: always, max: 10000, backoff: [50ms, 500ms]}}" for name in VICTIMS]
    lines += ["  calm:", "  steady:", "nodes:"]
    everybody = ("main", *VICTIMS)
    for name in everybody:
        hears = ", ".join(f"beater_{other}" for other in everybody if other != name)
        lines.append(f"  beater_{name}: {{plugin: beater, process: {name}, parameters: {{hears: [{hears}]}}}}")
    for name, other in (("calm", "steady"), ("steady", "calm")):
        lines.append(f"  beater_{name}: {{plugin: beater, process: {name}, parameters: {{hears: [beater_{other}]}}}}")
    return "\n".join(lines) + "\n"


@contextmanager
def started() -> Iterator[tuple[Run, Path]]:
    """The run in a folder of its own, ended whatever happens."""
    with (
        tempfile.TemporaryDirectory(prefix="chaos") as folder,
        # The path of a socket must be short, which not every system's own folder for such files lets it be.
        tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as runtime,
    ):
        (Path(folder) / "plugins").mkdir()
        (Path(folder) / "plugins/beater.py").write_text(PLUGIN)
        (Path(folder) / "chaos.yaml").write_text(launch_file())
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
    from busflow.wire.roll_call import call_roll

    began = time.perf_counter()
    while (took := time.perf_counter() - began) < within_s:
        for present in call_roll(0.5):
            states = Counter[str]()
            for process in present.processes:
                states.update(process["states"])
            if states == {"running": 6}:
                return took
        time.sleep(0.05)
    return None


def attack(run: Run, outcome: Outcome, seconds: float) -> None:
    """Hit processes at random for a time; what is stopped goes on in the end."""
    chance = random.Random(outcome.seed)
    digest = hashlib.sha256()
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        time.sleep(chance.uniform(0.2, 1.5))
        process, fault = chance.choice(VICTIMS), chance.choice(["SIGKILL", "SIGKILL", "SIGSTOP", "SIGTERM", "SIGSEGV"])
        pause_s = chance.uniform(0.1, 4.0)
        digest.update(f"{process} {fault} {pause_s:.3f};".encode())
        if not run.hit(process, signal.Signals[fault]):
            continue
        outcome.faults[fault] += 1
        if fault == "SIGSTOP":
            stopped = run.pids[process]
            time.sleep(pause_s)
            if run.pids[process] == stopped:
                run.hit(process, signal.SIGCONT)
    outcome.schedule = digest.hexdigest()[:12]


def judge(run: Run, folder: Path, outcome: Outcome) -> None:
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
            if topic["published"] - line["delivered"] > 1 or topic["losses"]:  # one may be on its way at the end
                outcome.broken.append(
                    f"I1: {topic['name']}: {topic['published']} published, {line['delivered']} delivered"
                )
    if run.out_of_order:
        outcome.broken.append(f"I2: {len(run.out_of_order)} out of order, first {run.out_of_order[0]}")


def chaos(seconds: float, seed: int) -> Outcome:
    """Attack a run for so long, and say what it came to."""
    outcome = Outcome(seed)
    with started() as (run, folder):
        if all_answer(PATIENCE_S) is None:
            outcome.broken.append(f"it did not start: {''.join(run.told)}")
            return outcome
        before = run.resources()
        attack(run, outcome, seconds)
        recovery_s = all_answer(PATIENCE_S)
        if recovery_s is None or recovery_s > RECOVERY_S:
            outcome.broken.append(f"I11: not everything ran again within {RECOVERY_S:g} s, but after {recovery_s} s")
        outcome.recovery_s = recovery_s or PATIENCE_S
        after = run.resources()
        if after[0] > before[0] + 2 or after[1] > before[1] + 2:
            outcome.broken.append(f"I6: descriptors and threads were {before}, and are {after}")
        outcome.stop_s = run.end()
        judge(run, folder, outcome)
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
    print(f"all ran again after {outcome.recovery_s:.1f} s; Ctrl-C took {outcome.stop_s:.2f} s")
    for broken in outcome.broken:
        print(f"BROKEN {broken}")
    return 1 if outcome.broken else 0


if __name__ == "__main__":
    sys.exit(main())
