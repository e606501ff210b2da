"""The lab of `configs/lab1.yaml` in DDS alone, each half a program: `python lab.py DOMAIN sensors|processor`.

It declares ROS 2's types by itself and imports nothing of busflow. What the processor publishes, and what it gets of it
as the other half, it prints.
"""

import math
import sys
import time
from dataclasses import dataclass, field

from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, sequence
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from ros2_types import Float64, Header, Imu, Vector3

LOOPBACK = """<CycloneDDS><Domain Id="any"><General><Interfaces>
<NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces></General><Discovery>
<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""
CDR = Policy.DataRepresentation(use_cdrv0_representation=True)
SENSOR_DATA = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(5), CDR)
RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10), CDR)
RATE_HZ = 10


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header = field(default_factory=Header)
    name: sequence[str] = ()
    position: sequence[float64] = ()
    velocity: sequence[float64] = ()
    effort: sequence[float64] = ()


def tell(line):
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def sensors(participant):
    imus = DataWriter(participant, Topic(participant, "rt/imu/data", Imu), qos=SENSOR_DATA)
    joints = DataWriter(participant, Topic(participant, "rt/joint_states", JointState), qos=RELIABLE)
    balances = DataReader(participant, Topic(participant, "rt/balance_state", Float64), qos=RELIABLE)
    names = [f"{side}_{joint}_joint" for joint in ("hip", "knee", "ankle") for side in ("left", "right")]
    start = time.monotonic()
    while True:
        now = time.monotonic() - start
        imus.write(Imu(header=Header(frame_id="imu_link"), linear_acceleration=Vector3(0.0, 0.5, 9.8)))
        angles = [0.2 * math.sin(now) for _ in names]
        joints.write(JointState(name=names, position=angles, velocity=[0.0] * len(names), effort=[0.0] * len(names)))
        for balance in balances.take(N=10):
            tell(f"balance {balance.data}")
        time.sleep(1 / RATE_HZ)


def processor(participant):
    imus = DataReader(participant, Topic(participant, "rt/imu/data", Imu), qos=SENSOR_DATA)
    joints = DataReader(participant, Topic(participant, "rt/joint_states", JointState), qos=RELIABLE)
    balances = DataWriter(participant, Topic(participant, "rt/balance_state", Float64), qos=RELIABLE)
    stabilities = DataWriter(participant, Topic(participant, "rt/stability_index", Float64), qos=RELIABLE)
    for imu in imus.take_iter():
        turn, pull = imu.angular_velocity, imu.linear_acceleration
        balance = min(1.0, (abs(pull.y) + math.hypot(turn.x, turn.y, turn.z)) / 2.0)
        balances.write(Float64(balance))
        stabilities.write(Float64(1.0 - balance))
        for state in joints.take(N=10):
            tell(f"joints {len(state.name)}")


if __name__ == "__main__":
    number = int(sys.argv[1])
    domain = Domain(number, LOOPBACK)
    {"sensors": sensors, "processor": processor}[sys.argv[2]](DomainParticipant(number))
