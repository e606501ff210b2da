"""The lab of `configs/lab1.yaml` on raw Zenoh sessions, each half a program: `python -m … PORT sensors|processor`.

It writes ROS 2's CDR and keys by itself. What it gets of the other half, it prints.
"""

import math
import struct
import sys
import threading
import time
from types import SimpleNamespace
from typing import Any

from tests.ros2.rmw_node import RmwNode
from tests.ros2.sessions import rmw_session

IMU, JOINTS, FLOAT = (
    SimpleNamespace(name=name, type_hash=type_hash)
    for name, type_hash in (
        ("sensor_msgs/msg/Imu", "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"),
        ("sensor_msgs/msg/JointState", "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"),
        ("std_msgs/msg/Float64", "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a"),
    )
)
SENSOR_DATA, RELIABLE = "2::,5:,:,:,,", "::,10:,:,:,,"
HEAD = b"\0\1\0\0"
RATE_HZ = 10


class Cdr:
    """A message of CDR as it grows, or as it is read."""

    def __init__(self, data: bytes = b"") -> None:
        self.data, self.at = bytearray(data[4:]), 0

    def put(self, form: str, *values: Any) -> None:
        self.data += bytes(-len(self.data) % struct.calcsize(form[-1]))
        self.data += struct.pack(f"<{form}", *values)

    def put_text(self, text: str) -> None:
        self.put("I", len(text) + 1)
        self.data += text.encode() + b"\0"

    def put_header(self, frame: str) -> None:
        self.put("i", 0)
        self.put("I", 0)
        self.put_text(frame)

    def put_floats(self, values: list[float]) -> None:
        self.put("I", len(values))
        if values:
            self.put(f"{len(values)}d", *values)

    def get(self, form: str) -> tuple[Any, ...]:
        self.at += -self.at % struct.calcsize(form[-1])
        found = struct.unpack_from(f"<{form}", self.data, self.at)
        self.at += struct.calcsize(f"<{form}")
        return found

    def skip_header(self) -> None:
        self.get("i")
        _, length = self.get("I")[0], self.get("I")[0]
        self.at += length

    @property
    def whole(self) -> bytes:
        return HEAD + bytes(self.data)


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def imu(pull_y: float) -> bytes:
    message = Cdr()
    message.put_header("imu_link")
    message.put("4d", 0.0, 0.0, 0.0, 1.0)
    message.put("9d", *[0.0] * 9)
    message.put("3d", 0.0, 0.0, 0.0)
    message.put("9d", *[0.0] * 9)
    message.put("3d", 0.0, pull_y, 9.8)
    message.put("9d", *[0.0] * 9)
    return message.whole


def joints(names: list[str], angle: float) -> bytes:
    message = Cdr()
    message.put_header("")
    message.put("I", len(names))
    for name in names:
        message.put_text(name)
    message.put_floats([angle] * len(names))
    message.put_floats([0.0] * len(names))
    message.put_floats([])
    return message.whole


def sensors(ros: RmwNode) -> None:
    publish_imu = ros.publisher("/imu/data", IMU, SENSOR_DATA)
    publish_joints = ros.publisher("/joint_states", JOINTS, RELIABLE)
    ros.subscription(
        "/balance_state", FLOAT, lambda sample: say(f"balance {Cdr(sample.payload.to_bytes()).get('d')[0]}")
    )
    names = [f"{side}_{joint}_joint" for joint in ("hip", "knee", "ankle") for side in ("left", "right")]
    start = time.monotonic()
    while True:
        publish_imu(imu(0.5))
        publish_joints(joints(names, 0.2 * math.sin(time.monotonic() - start)))
        time.sleep(1 / RATE_HZ)


def processor(ros: RmwNode) -> None:
    publish_balance = ros.publisher("/balance_state", FLOAT, RELIABLE)

    def on_imu(sample: Any) -> None:
        message = Cdr(sample.payload.to_bytes())
        message.skip_header()
        message.get("13d")
        turn = message.get("3d")
        message.get("9d")
        pull = message.get("3d")
        balance = Cdr()
        balance.put("d", min(1.0, (abs(pull[1]) + math.hypot(*turn)) / 2.0))
        publish_balance(balance.whole)

    def on_joints(sample: Any) -> None:
        message = Cdr(sample.payload.to_bytes())
        message.skip_header()
        say(f"joints {message.get('I')[0]}")

    ros.subscription("/imu/data", IMU, on_imu, SENSOR_DATA)
    ros.subscription("/joint_states", JOINTS, on_joints, RELIABLE)
    threading.Event().wait()


if __name__ == "__main__":
    with rmw_session(int(sys.argv[1])) as opened_session:
        node = RmwNode(opened_session, sys.argv[2])
        {"sensors": sensors, "processor": processor}[sys.argv[2]](node)
