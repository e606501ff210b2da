"""What a robot of 31 joints costs at 100 Hz on real time, and what becomes of it when its nodes are killed at random.

Run it with `python benchmarks/humanoid.py`, or `--kill` for the second part; `--seconds 60` says for how long. The
first part is `busflow run` in a process of its own, with all that a user's run has. It prints the share of one CPU
core that the process took, its start included, and fails if a message was dropped. The second lets a node fail
about once a second, as if its own code had raised, and fails if another one stopped, if a message is not accounted
for, or if the report does not tell every failure.
"""

import argparse
import asyncio
import json
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import busflow
from busflow.node import runtime_of

ROOT = Path(__file__).parents[1]
CONFIG = ROOT / "configs/humanoid.yaml"
PAUSE_S = 1.0
"""How long between two failures, on average."""


def run(seconds: float) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "report.json"
        command = [sys.executable, "-m", "busflow", "run", str(CONFIG), "--for", f"{seconds}s", "--report", str(file)]
        began = time.monotonic()
        subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, check=True)  # noqa: S603  # our own command
        took = time.monotonic() - began
        report = json.loads(file.read_text("utf-8"))
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    published = sum(topic["published"] for topic in report["topics"])
    lines = [line for topic in report["topics"] for line in topic["subscriptions"]]
    dropped, missed = sum(line["dropped"] for line in lines), sum(timer["missed"] for timer in report["timers"])
    late = max(timer["lateness_p99_s"] or 0.0 for timer in report["timers"])
    print(f"{len(report['nodes'])} nodes, {published} messages in {report['duration_s']:.1f} s, {dropped} dropped")
    fired = sum(timer["fired"] for timer in report["timers"])
    print(f"timers: {missed} ticks missed of {missed + fired}, the latest timer's p99 {late * 1e3:.1f} ms late")
    print(f"CPU: {100 * (used.ru_utime + used.ru_stime) / took:.1f} % of one core")
    if dropped:
        raise SystemExit("messages were dropped")


async def kill(seconds: float, seed: int) -> None:
    chance = random.Random(seed)
    killed: Counter[str] = Counter()
    async with busflow.launch(CONFIG) as graph:
        names = [node.name for node in graph.report().nodes]
        end = graph.clock.seconds() + seconds
        while graph.clock.seconds() < end:
            await asyncio.sleep(chance.expovariate(1 / PAUSE_S))
            running = [node.name for node in graph.report().nodes if node.state == "running"]
            name = chance.choice(running)
            killed[name] += 1
            runtime_of(graph.node(name)).fail("benchmarks/humanoid.py", RuntimeError("killed at random"))
            await asyncio.sleep(0)
            others = {node.name: node.state for node in graph.report().nodes if node.name not in killed}
            if set(others.values()) - {"running"}:
                raise SystemExit(f"others stopped when {name} was killed: {others}")
        await asyncio.sleep(6)  # longer than the longest pause before a restart
        report = graph.report()
    for node in report.nodes:
        print(f"{node.name:25} killed {killed[node.name]:2}, restarted {node.restarts:2}, {node.state}")
    if {node.name: node.failures for node in report.nodes} != {name: killed[name] for name in names}:
        raise SystemExit("the report does not tell every failure")
    if {node.state for node in report.nodes} != {"running"}:
        raise SystemExit("not every node is back")
    lines = [line for topic in report.topics for line in topic.subscriptions]
    if any(line.published != line.delivered + line.dropped + line.queued for line in lines):
        raise SystemExit("the ledger does not add up")
    print(f"{killed.total()} failures of {len(killed)} nodes; every other node went on, every message is accounted for")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kill", action="store_true", help="let nodes fail at random")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0, help="which node fails when")
    given = parser.parse_args()
    if given.kill:
        asyncio.run(kill(given.seconds, given.seed))
    else:
        run(given.seconds)


if __name__ == "__main__":
    main()
