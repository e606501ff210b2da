"""What a robot of 31 joints costs at 100 Hz on real time, and what becomes of it when its nodes are killed at random.

Run it with `python benchmarks/humanoid.py`, or `--kill` for the second part; `--seconds 60` says for how long, and
`--processes 1,2,4` in how many processes. The first part is `busflow run` with all that a user's run has. It prints the
share of one CPU core that it took, its start included, how old messages are when a node of the main process has them,
and on virtual time a digest of what each topic carried, which has to be the same for every number of processes. It
fails if it is not, or if a message was dropped. The second part lets a node fail about once a second, as if its own
code had raised, and fails if another one stopped, if a message is not accounted for, or if the report does not tell
every failure.
"""

import argparse
import asyncio
import hashlib
import json
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import busflow
from busflow.node.node import runtime_of

ROOT = Path(__file__).parents[1]
CONFIG = ROOT / "configs/humanoid.yaml"
PAUSE_S = 1.0
"""How long between two failures, on average."""


FEET, IMUS = ["left/foot_sensor", "right/foot_sensor"], ["pelvis/imu_sensor", "head/imu_sensor"]
PLACEMENTS: dict[int, dict[str, list[str]]] = {
    1: {},
    2: {"sensors": ["left/joints", "right/joints", "trunk/joints", *FEET, *IMUS, "head/camera"]},
    4: {
        "left": ["left/joints", "left/foot_sensor"],
        "right": ["right/joints", "right/foot_sensor"],
        "middle": ["trunk/joints", *IMUS, "head/camera"],
    },
}
"""By number of processes, which nodes are in which beside the main one."""
PROBE = '''
import json

from busflow import SENSOR_DATA, Node, Parameters
from busflow.msgs.sensor_msgs import Image, Imu, JointState

TYPES = {"left/joint_states": JointState, "pelvis/imu/data": Imu, "head/camera/image_raw": Image}


class ProbeParameters(Parameters):
    file: str


class Probe(Node):
    """Writes down how old messages are when it has them."""

    parameters: ProbeParameters

    def declare(self) -> None:
        self.ages = {topic: [] for topic in TYPES}
        for topic, message_type in TYPES.items():
            handler = lambda message, ages=self.ages[topic]: self.hear(message, ages)
            self.create_subscription(message_type, topic, handler, qos=SENSOR_DATA)

    def hear(self, message, ages) -> None:
        stamp = message.header.stamp
        ages.append((self.clock.now().nanoseconds - stamp.sec * 1_000_000_000 - stamp.nanosec) / 1e3)

    async def stop(self) -> None:
        with open(self.parameters.file, "w") as file:
            json.dump(self.ages, file)
'''


def placed(folder: Path, processes: int) -> Path:
    """The humanoid's launch file with its nodes in so many processes."""
    (folder / "probes").mkdir(exist_ok=True)
    (folder / "probes/probe.py").write_text(PROBE, "utf-8")
    lines = ["name: humanoid", "plugins: [probes]", "include:", f"  - file: {CONFIG}", "nodes:"]
    lines += [f"  probe: {{plugin: probe, parameters: {{file: {folder / 'ages.json'}}}}}"]
    for process, nodes in PLACEMENTS[processes].items():
        lines += [f"  {node}: {{process: {process}}}" for node in nodes]
    if PLACEMENTS[processes]:
        lines += ["processes:", *(f"  {process}:" for process in PLACEMENTS[processes])]
    file = folder / "humanoid.yaml"
    file.write_text("\n".join(lines) + "\n", "utf-8")
    return file


def run(seconds: float, processes: int) -> list[str]:
    """Run it and tell what it cost; what was dropped."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        told, file = folder / "report.json", placed(folder, processes)
        command = [sys.executable, "-m", "busflow", "run", str(file), "--for", f"{seconds}s", "--report", str(told)]
        began, before = time.monotonic(), _cpu_s()
        subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, check=True)  # noqa: S603  # our own command
        took, used = time.monotonic() - began, _cpu_s() - before
        report = json.loads(told.read_text("utf-8"))
        ages = json.loads((folder / "ages.json").read_text("utf-8"))
    published = sum(topic["published"] for topic in report["topics"])
    lines = [line for topic in report["topics"] for line in topic["subscriptions"]]
    # Whoever asks for the newest alone has older ones give way, which several at once from another process do.
    dropped = sum(line["dropped"] for line in lines if line["depth"] > 1)
    missed = sum(timer["missed"] for timer in report["timers"])
    late = max(timer["lateness_p99_s"] or 0.0 for timer in report["timers"])
    print(
        f"{processes} processes, {len(report['nodes'])} nodes: {published} messages in {report['duration_s']:.1f} s, ",
        end="",
    )
    fired = sum(timer["fired"] for timer in report["timers"])
    print(
        f"{dropped} dropped; {missed} ticks missed of {missed + fired}, the latest timer's p99 {late * 1e3:.1f} ms late"
    )
    print(f"  CPU: {100 * used / took:.1f} % of one core")
    for topic, found in ages.items():
        p50, p99 = (sorted(found)[int(len(found) * share)] / 1e3 for share in (0.5, 0.99))
        print(f"  /{topic}: {p50:.2f} ms old at the median, p99 {p99:.2f} ms ({len(found)} messages)")
    return [f"{line['node']}: {line['drops']}" for line in lines if line["depth"] > 1 and line["dropped"]]


def _cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def digest(seconds: float, processes: int) -> dict[str, str]:
    """By topic, a digest of what it carried in a time, on virtual time."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        trace = folder / "trace.txt"
        command = [sys.executable, "-m", "busflow", "run", str(placed(folder, processes)), "--sim", "--seed", "7"]
        command += ["--for", f"{seconds}s", "--trace", str(trace)]
        subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, check=True)  # noqa: S603  # our own command
        found: defaultdict[str, Any] = defaultdict(hashlib.sha256)
        for line in trace.read_text("utf-8").splitlines():
            _, kind, topic, *rest = line.split(" ", 3)
            if kind == "publish" and topic != "/rosout":  # the probe's file has another name each time
                found[topic].update(" ".join(rest).encode())
    return {topic: each.hexdigest()[:12] for topic, each in sorted(found.items())}


def spread(seconds: float, numbers: Sequence[int]) -> None:
    """The first part, in each number of processes."""
    dropped = [each for processes in numbers for each in run(seconds, processes)]
    digests = {processes: digest(10.0, processes) for processes in numbers}
    for topic, each in digests[numbers[0]].items():
        print(f"{each} {topic}")
    if len({json.dumps(each) for each in digests.values()}) > 1:
        raise SystemExit(f"the placement changes what topics carry: {digests}")
    print(f"the same in {', '.join(map(str, numbers))} processes, 10 s of virtual time")
    if dropped:
        raise SystemExit(f"messages were dropped: {', '.join(dropped)}")


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
            runtime_of(graph.node(name)).life.fail("benchmarks/humanoid.py", RuntimeError("killed at random"))
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
    parser.add_argument("--processes", default="1,2,4", help="in how many, one after the other")
    given = parser.parse_args()
    if given.kill:
        asyncio.run(kill(given.seconds, given.seed))
    else:
        spread(given.seconds, [int(each) for each in given.processes.split(",")])


if __name__ == "__main__":
    main()
