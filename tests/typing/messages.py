# pyright: strict, reportUnnecessaryTypeIgnoreComment=true
"""What a strict type checker sees of messages: read, never run; each ignore must be needed."""

from collections.abc import Sequence
from typing import Annotated, ClassVar, assert_type

import numpy as np
from numpy.typing import NDArray

from busflow.clock import Clock
from busflow.clock import Duration as ClockDuration
from busflow.interfaces.message import (
    BoolArray,
    Float64Array,
    Length,
    Message,
    UInt8Array,
    array,
    float32,
    float64,
    take,
    uint8,
    zeros,
)
from busflow.msgs.builtin_interfaces import Duration, Time
from busflow.msgs.geometry_msgs import Vector3
from busflow.msgs.sensor_msgs import Image, Imu, JointState
from busflow.msgs.std_msgs import Header
from busflow.msgs.std_srvs import Trigger
from busflow.msgs.trajectory_msgs import JointTrajectoryPoint


class Balance(Message, package="my_robot"):
    LEFT: ClassVar[uint8] = 0

    header: Header = Header()
    value: float64
    ratio: float32 = 1.0
    side: uint8 = 0
    gains: Annotated[Float64Array, Length(3)] = zeros(3)
    offsets: Float64Array = array([1.0, 2.0])
    picture: UInt8Array = zeros()
    flags: BoolArray = zeros()
    raw: NDArray[np.float32] = zeros()
    names: Sequence[str] = ()
    points: Sequence[Vector3] = ()
    label: Annotated[str, Length(max=10)] = ""


def reading(imu: Imu, joints: JointState, balance: Balance, image: Image) -> None:
    assert_type(imu.linear_acceleration.x, float)
    assert_type(imu.orientation_covariance, NDArray[np.float64])
    assert_type(imu.header.stamp, Time)
    assert_type(imu.header.stamp.sec, int)
    assert_type(joints.position, NDArray[np.float64])
    assert_type(joints.name, Sequence[str])
    assert_type(balance.gains, NDArray[np.float64])
    assert_type(balance.flags, NDArray[np.bool_])
    assert_type(balance.points[0].x, float)
    assert_type(balance.side, int)
    assert_type(image.data, NDArray[np.uint8])
    assert_type(balance.replace(value=2.0), Balance)
    assert_type(Balance.LEFT, int)
    assert_type(take(np.zeros(3)).dtype, np.dtype[np.float64])
    assert_type(Trigger.Response(success=True).message, str)


def constructing(clock: Clock, frame: NDArray[np.uint8], measured: NDArray[np.float64]) -> None:
    Balance(value=1)
    Balance(value=measured[0], gains=[1, 2.5, np.float32(3)], names=["a"], points=[Vector3(x=1)])
    Balance(value=np.float64(1), gains=measured, offsets=np.zeros(2, np.int16), flags=[True, np.True_])
    JointState(name=["a"], position=[0.1], velocity=(1, 2), effort=measured)
    Image(data=frame)
    Image(data=take(frame.reshape(-1)))
    Image(data=b"\x00")
    Header(stamp=clock.now(), frame_id="imu_link")
    Header(stamp=Time(sec=1))
    JointTrajectoryPoint(time_from_start=ClockDuration(1))
    JointTrajectoryPoint(time_from_start=Duration(sec=1))


def mistakes(message: Balance) -> None:
    Balance()  # pyright: ignore[reportCallIssue]  # a field without a default has to be given
    Balance(value=1, valeu=2)  # pyright: ignore[reportCallIssue]  # no such field
    Balance(value="1")  # pyright: ignore[reportArgumentType]  # text is no number
    Balance(value=1, gains="123")  # pyright: ignore[reportArgumentType]  # nor an array
    Balance(value=1, gains=["1"])  # pyright: ignore[reportArgumentType]  # nor inside one
    Balance(value=1, gains=np.zeros(3, np.complex64))  # pyright: ignore[reportArgumentType]  # nor a complex one
    Balance(value=1, flags=[0.5])  # pyright: ignore[reportArgumentType]  # a number is not a boolean
    Image(data=[0.5])  # pyright: ignore[reportArgumentType]  # a byte is an integer
    Header(stamp=1.0)  # pyright: ignore[reportArgumentType]  # seconds are no Time
    Header(stamp=ClockDuration(1))  # pyright: ignore[reportArgumentType]  # nor is a span
    Header(stamp=Duration(sec=1))  # pyright: ignore[reportArgumentType]  # nor its message
    message.value = 2.0  # pyright: ignore[reportAttributeAccessIssue]  # a message cannot change
    message.gains = [1, 2, 3]  # pyright: ignore[reportAttributeAccessIssue]  # nor can its arrays be swapped
