"""A small bag, written by rosbags in each form that it knows."""

import numpy as np
import pytest
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import CompressionFormat, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
STORAGES = pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3], ids=["mcap", "sqlite3"])
OFFERED = Qos(
    QosHistory.KEEP_LAST,
    5,
    QosReliability.RELIABLE,
    QosDurability.VOLATILE,
    QosTime(9223372036, 854775807),
    QosTime(9223372036, 854775807),
    QosLiveliness.AUTOMATIC,
    QosTime(9223372036, 854775807),
    False,
)


def messages():
    """Topic, type and value of a few messages with arrays, text and messages inside messages."""
    types = STORE.types
    stamp = types["builtin_interfaces/msg/Time"](sec=7, nanosec=8)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="imu_link")
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    yield (
        "/imu/data",
        "sensor_msgs/msg/Imu",
        types["sensor_msgs/msg/Imu"](
            header=header,
            orientation=quaternion(x=0.0, y=0.5, z=0.0, w=1.0),
            orientation_covariance=np.arange(9, dtype=np.float64),
            angular_velocity=vector(x=1.0, y=2.0, z=3.0),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=vector(x=0.0, y=0.0, z=9.81),
            linear_acceleration_covariance=np.zeros(9),
        ),
    )
    yield (
        "/joint_states",
        "sensor_msgs/msg/JointState",
        types["sensor_msgs/msg/JointState"](
            header=header,
            name=["hüfte", "", "knee"],
            position=np.array([0.1, 0.2, 0.3]),
            velocity=np.array([]),
            effort=np.array([1e300, -0.0, np.inf]),
        ),
    )
    yield "/talk", "std_msgs/msg/String", types["std_msgs/msg/String"](data="Grüße")


def write_bag(path, storage=StoragePlugin.MCAP, version=9, compression=None):
    to = Writer(path, version=version, storage_plugin=storage)
    if compression:
        to.set_compression(compression, CompressionFormat.ZSTD)
    with to as writer:
        for number, (topic, name, message) in enumerate(messages()):
            connection = writer.add_connection(topic, name, typestore=STORE, offered_qos_profiles=[OFFERED])
            writer.write(connection, 1_000 + number, STORE.serialize_cdr(message, name))
    return path
