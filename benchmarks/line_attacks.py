"""Attacks on what crosses between the processes of a run: `python benchmarks/line_attacks.py`.

- `payloads`: blobs of 40 to 100 kB with a checksum, 100,000 of them: each arrives once, whole and in order.
- `clients`: the same with 1 byte to 100 kB, small and large ones in turn, while 20 times `busflow topic echo` comes and
  goes.
- `kills`: blobs of 1 MB, while the process of their pusher and that of their checker are killed, 50 times each. Blobs
  are whole and in order, nobody else loses any, and the survivor knows of each death soon.

In each the ledger balances, and no socket or process is left. `--quick` does a little of each.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from subprocess import DEVNULL, PIPE, Popen
from threading import Condition, Thread
from typing import Any

NODES = Path(__file__).parent / "crossing/nodes"
PATIENCE_S = 300.0
FLOW = """\
processes: {far: }
network: {line: LINE}
nodes:
  pusher: {plugin: "checked:Pusher", process: far, parameters: {least: LEAST, most: MOST, window: 48}}
  checker: {plugin: "checked:Checker", parameters: {count: COUNT}}
"""
RESTART = "{policy: always, max: 1000, window: 1s, backoff: [10ms, 20ms]}"
KILLS = """\
processes: {left: {restart: RESTART}, right: {restart: RESTART}, calm: }
network: {line: LINE}
nodes:
  left: {plugin: "checked:Pusher", process: left, parameters: {rate_hz: 60}}
  right: {plugin: "checked:Checker", process: right}
  here: {plugin: "checked:Checker"}
  calm: {plugin: "checked:Pusher", process: calm, parameters: {topic: calm, rate_hz: 60}, remap: {blobs: calm}}
  still: {plugin: "checked:Checker", parameters: {topic: calm}, remap: {blobs: calm}}
  main: {plugin: "checked:Pusher", parameters: {rate_hz: 60, topic: down}, remap: {blobs: down}}
  down: {plugin: "checked:Checker", process: right, parameters: {topic: down}, remap: {blobs: down}}
"""


@dataclass
class Found:
    """What an attack came to."""

    figures: dict[str, float] = field(default_factory=dict[str, float])
    broken: list[str] = field(default_factory=list[str])


class Run:
    """A run under attack, in a folder of its own."""

    def __init__(self, folder: Path, text: str) -> None:
        self.folder = folder
        (folder / "run.yaml").write_text(f"plugins: [{NODES}]\nshutdown: {{grace: 20s}}\n{text}")
        command = [sys.executable, "-m", "busflow", "run", "run.yaml", "-v", "--log-format", "json"]
        self.process = Popen(  # noqa: S603  # our own interpreter
            [*command, "--report", "report.json"],
            cwd=folder,
            stdout=DEVNULL,
            stderr=PIPE,
            text=True,
        )
        self.lines: list[dict[str, Any]] = []
        self.told: list[str] = []
        self._arrived = Condition()
        self._over = False
        self._reader = Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None  # noqa: S101  # it is a pipe
        with self.process.stderr as lines:
            for text in lines:
                with self._arrived:
                    if text.startswith("{"):
                        self.lines.append(json.loads(text))
                    else:
                        self.told.append(text)
                    self._arrived.notify_all()
        with self._arrived:
            self._over = True
            self._arrived.notify_all()

    def those(self, event: str, **values: object) -> list[dict[str, Any]]:
        """The lines of the log with this in their event and these values."""
        return [
            line
            for line in [*self.lines]
            if event in line["event"] and all(line.get(key) == value for key, value in values.items())
        ]

    def wait_for(self, condition: Callable[[], bool], what: str) -> None:
        """Wait until the log fulfils a condition."""
        with self._arrived:
            self._arrived.wait_for(lambda: self._over or condition(), timeout=PATIENCE_S)
            if not condition():
                raise RuntimeError(f"in vain: {what}; {self.lines[-3:]} {''.join(self.told)}")

    def pids(self) -> dict[str, int]:
        """The processes as they were started last."""
        return {line["event"].split()[2]: line["pid"] for line in self.those(" is started")}

    def end(self) -> dict[str, Any]:
        """End it, and return its report."""
        self.process.send_signal(signal.SIGINT)
        self.process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        return json.loads((self.folder / "report.json").read_text())


@contextlib.contextmanager
def started(text: str) -> Iterator[Run]:
    """A run that is ended whatever happens, and leaves nothing."""
    with (
        tempfile.TemporaryDirectory(prefix="lines") as folder,
        # The path of a socket must be short, which not every system's own folder for such files lets it be.
        tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as runtime,
    ):
        os.environ["BUSFLOW_RUNTIME_DIR"] = runtime
        run = Run(Path(folder), text)
        try:
            yield run
        finally:
            if run.process.poll() is None:
                run.process.kill()
                run.process.wait()


def judge(run: Run, found: Found) -> None:
    """End a run, and look at its account and at what it leaves."""
    pids = [line["pid"] for line in run.those(" is started")]
    report = run.end()
    for topic in report["topics"]:
        for line in topic["subscriptions"]:
            if line["published"] != line["delivered"] + line["dropped"] + line["queued"]:
                found.broken.append(f"the account of {line['node']} on {topic['name']} does not balance: {line}")
    left = [path.name for path in Path(os.environ["BUSFLOW_RUNTIME_DIR"]).iterdir() if path.name != ".lock"]
    left += [str(pid) for pid in pids if Path(f"/proc/{pid}").exists()]
    if left:
        found.broken.append(f"left over: {left}")
    found.broken += [f"log: {line['event']}" for line in run.those("Traceback")]


def flow(count: int, least: int, most: int, *, line: bool, clients: int = 0) -> Found:
    """Push so many blobs, beside so many clients that come and go."""
    text = FLOW
    for word, value in {"LINE": line, "COUNT": count, "LEAST": least, "MOST": most}.items():
        text = text.replace(word, str(value).lower())
    found, began = Found(), time.perf_counter()
    with started(text) as run:
        heard = echoes(run, clients)
        run.wait_for(lambda: bool(run.those("complete")), f"{count} blobs")
        took = time.perf_counter() - began
        (told,) = run.those("complete")
        judge(run, found)
    counts = {name: told[name] for name in ("received", "wrong", "disorder", "gaps")}
    if counts != {"received": count, "wrong": 0, "disorder": 0, "gaps": 0}:
        found.broken.append(f"blobs: {counts}")
    if sorted(heard) != heard:
        found.broken.append(f"a client heard {heard}")
    found.figures = {**counts, "seconds": took, "clients": clients}
    return found


def echoes(run: Run, times: int) -> list[int]:
    """The numbers that so many commands have heard, one after the other."""
    from busflow.cli import main

    if not times:
        return []
    run.wait_for(lambda: bool(run.those("writers")), "a publisher")
    heard: list[int] = []
    for _ in range(times):
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            code = main(["topic", "echo", "blobs", "-n", "3", "--field", "height"])
        if code == 0:
            heard += [int(word) for word in out.getvalue().split() if word.isdecimal()]
    return heard


def kills(times: int, seed: int, *, line: bool) -> Found:
    """Kill each of two processes so often, at random moments."""
    text = KILLS.replace("RESTART", RESTART).replace("LINE", str(line).lower())
    found, chance = Found(), random.Random(seed)
    known_s: list[float] = []
    with started(text) as run:
        for number in range(2 * times):
            victim = ("left", "right")[number % 2]
            known_s.append(kill(run, victim, number // 2, chance.uniform(0, 0.3)))
        run.wait_for(lambda: alive(run, "left", times) and alive(run, "right", times), "all run again")
        judge(run, found)
    checked = [line for line in run.those("checked") if line["node"] in {"/here", "/still"}]
    for told in checked:
        if told["wrong"] or told["disorder"] or (told["node"] == "/still" and told["gaps"]):
            found.broken.append(f"blobs: {told}")
    received = {told["node"]: told["received"] for told in checked}
    if received.keys() != {"/here", "/still"}:
        found.broken.append(f"only {[*received]} were told of")
    found.figures = {"kills": 2 * times, "known p50 s": median(known_s), "known worst s": max(known_s), **received}
    return found


def alive(run: Run, process: str, restarts: int) -> bool:
    """Whether blobs come from a process, or reach it, that has been started again so often."""
    checker = "/here" if process == "left" else "/down"
    started = len(run.those(f"the process {process} is started"))
    return started > restarts and len(run.those("first", node=checker)) > restarts


def kill(run: Run, process: str, restarts: int, after_s: float) -> float:
    """Kill a process among its blobs; how long until the survivor has logged it."""
    node, event = ("/here", "writers") if process == "left" else ("/main", "readers")
    run.wait_for(lambda: alive(run, process, restarts), f"{process} works")
    time.sleep(after_s)
    gone = len(run.those(event, node=node, current=0))
    killed_ns = time.time_ns()
    os.kill(run.pids()[process], signal.SIGKILL)
    run.wait_for(lambda: len(run.those(event, node=node, current=0)) > gone, f"the death of {process}")
    return (run.those(event, node=node, current=0)[-1]["stamp_ns"] - killed_ns) / 1e9


ATTACKS: dict[str, Callable[[bool, int, bool], Found]] = {
    "payloads": lambda quick, _seed, line: flow(1000 if quick else 100_000, 40_000, 100_000, line=line),
    "clients": lambda quick, _seed, line: flow(
        5000 if quick else 100_000, 1, 100_000, line=line, clients=5 if quick else 20
    ),
    "kills": lambda quick, seed, line: kills(1 if quick else 50, seed, line=line),
}


def main(words: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("attacks", nargs="*", choices=[[], *ATTACKS], default=[*ATTACKS])
    parser.add_argument("--quick", action="store_true", help="a little of each")
    parser.add_argument("--no-line", action="store_true", help="with network: {line: false}")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(words)
    broken = 0
    for name in given.attacks:
        found = ATTACKS[name](given.quick, given.seed, not given.no_line)
        print(name, ", ".join(f"{key} {value:g}" for key, value in found.figures.items()), flush=True)
        for each in found.broken:
            print(f"BROKEN {each}", flush=True)
        broken += len(found.broken)
    return min(broken, 1)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
