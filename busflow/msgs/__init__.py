"""ROS 2's standard messages and services, a module per package: `from busflow.msgs.sensor_msgs import Imu`.

Knows nothing but `interfaces`.
"""

from typing import Any


def export_types(module: dict[str, Any]) -> None:
    """Name the types that a module defines in its `__all__`."""
    types = [each for each in module.values() if isinstance(each, type) and each.__module__ == module["__name__"]]
    module["__all__"] = [each.__name__ for each in types]
