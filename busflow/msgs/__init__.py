"""ROS 2's standard messages and services, a module per package: `from busflow.msgs.sensor_msgs import Imu`.

Knows nothing but `interfaces`.
"""
