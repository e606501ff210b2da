"""Whether the memory of a recording grows: an hour at 200 Hz, in virtual time.

    python benchmarks/recording_hour.py [MINUTES]

An Imu and 31 joints are published at 200 Hz and recorded. Each 0.4 s has a chunk, as in a run on the wall's time.
The memory of the process is printed each time a sixth of the hour is over. It does not grow by more than 10 MB.
"""

import resource
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.recording import imu, joints
from busflow import Node, publisher, timer
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.testing import harness, virtual_time

MARKS = 6
MOST_MB = 10.0
_IMU, _JOINTS = imu(), joints()


class Robot(Node):
    """Publishes messages that are made already."""

    imu = publisher(Imu, "imu/data")
    joints = publisher(JointState, "joint_states")

    @timer(hz=200)
    def sense(self) -> None:
        self.imu.publish(_IMU)
        self.joints.publish(_JOINTS)


def resident_mb() -> float:
    """The memory of this process that is in use, on Linux."""
    return int(Path("/proc/self/statm").read_text("ascii").split()[1]) * resource.getpagesize() / 1e6


def main(minutes: float) -> None:
    """Record, and print the memory."""

    @virtual_time
    async def run() -> None:
        async with harness(Robot, record={"to": f"{folder}/run.mcap"}) as lab:
            await lab.advance(1.0)
            found: list[float] = []
            for mark in range(MARKS):
                await lab.advance(minutes * 60 / MARKS)
                found.append(resident_mb())
                print(f"after {(mark + 1) * minutes / MARKS:5.1f} min {found[-1]:8.1f} MB", flush=True)
            grown = max(found) - found[0]
            print(f"grown by {grown:.1f} MB since the first mark: {'flat' if grown <= MOST_MB else 'NOT FLAT'}")

    with tempfile.TemporaryDirectory() as folder:
        run()
        print(f"{Path(folder, 'run.mcap').stat().st_size / 1e6:.0f} MB of file")


if __name__ == "__main__":
    main(float((sys.argv[1:] or ["60"])[0]))
