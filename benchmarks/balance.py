"""How many seconds of the humanoid's life a second of CPU time computes, and the physics alone beside it.

Run it with `python benchmarks/balance.py`; it needs MuJoCo: `pip install '.[sim]'`. The CPU time is that of this
thread, and each figure the best of several rounds, taken in turn: other programs only ever make it slower.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from busflow.launchfile.load.load import load
from busflow.testing import harness, virtual_time
from busflow.testing.expectations import Trials
from plugins.humanoid_body import Body
from plugins.humanoid_simulator import HumanoidSimulator

FOLDER = Path(__file__).parents[1] / "configs"
CONFIG, MODEL = FOLDER / "lab_balance.yaml", FOLDER / "humanoid/lab.xml"
QUICK = "--quick" in sys.argv
"""One short round: to see that everything works."""
ROBOT_S = 2.0 if QUICK else 30.0
"""How long the robot lives in a round."""
PERIOD_S = 0.02
ROUNDS = 1 if QUICK else 7


def physics() -> None:
    """The body in the steps of the simulator's timer, its joints held by their motors."""
    body = Body(MODEL)
    for _ in range(round(ROBOT_S / PERIOD_S)):
        body.step(PERIOD_S)


@virtual_time
async def simulator() -> None:
    async with harness(HumanoidSimulator, keep=1) as lab:
        await lab.advance(ROBOT_S)


@virtual_time
async def graph() -> None:
    async with harness(CONFIG, keep=1) as lab:
        await lab.advance(ROBOT_S)


def tested() -> None:
    trials = Trials(load(CONFIG), ROBOT_S)
    trials.run([0])
    if trials.problems():
        sys.exit("the robot fell: these figures would be those of a robot that lies on the floor")


CASES: dict[str, Callable[[], None]] = {
    "the physics alone": physics,
    "the simulator's node, which publishes all of it": simulator,
    "the whole graph of configs/lab_balance.yaml": graph,
    "the same under `busflow test`, start and stop included": tested,
}


def main() -> None:
    least_s = dict.fromkeys(CASES, float("inf"))
    for _ in range(ROUNDS):
        for name, run in CASES.items():
            began = time.thread_time()
            run()
            least_s[name] = min(least_s[name], time.thread_time() - began)
    print(f"robot-seconds per CPU-second, best of {ROUNDS} rounds of {ROBOT_S:g} s:")
    for name, seconds in least_s.items():
        print(f"  {name:56} {ROBOT_S / seconds:6.0f}")


if __name__ == "__main__":
    main()
