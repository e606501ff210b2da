"""`sensor_msgs` reads a file when one of its types is named; `test_msgs.py` compares every field with ROS 2's.

Tests of `camera.py`, `environment.py`, `joystick.py`, `motion.py`, `multi_dof.py`, `points.py`, `power.py`,
`ranging.py` and `satellite.py`.
"""

import math

import pytest

from busflow.msgs import sensor_msgs
from busflow.msgs.sensor_msgs import BatteryState
from tests.new_interpreter import files_imported_for


def test_a_type_imports_only_files_that_it_needs():
    assert files_imported_for("sensor_msgs", "LaserScan") == ["sensor_msgs.ranging std_msgs.header"]


def test_large_package_lists_only_its_types():
    assert {*sensor_msgs.__all__} <= {*dir(sensor_msgs)}
    with pytest.raises(AttributeError, match="Imuu"):
        sensor_msgs.Imuu  # noqa: B018 - naming it is what is tested


def test_what_a_battery_does_not_measure_is_nan():
    state = BatteryState(temperature=math.nan)
    assert math.isnan(state.temperature)
    assert state == BatteryState(temperature=math.nan)
