"""Distances: laser scanners, and rangers that measure one distance."""

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.message import Float32Array, Message, float32, uint8, zeros
from busflow.msgs.std_msgs import Header


class LaserScan(Message, package="sensor_msgs"):
    """One sweep of a planar laser scanner.

    Angles are about the z axis of the frame, counter-clockwise seen from above, 0 along the x axis.
    """

    header: Header = Header()
    """`stamp` is when the first ray was measured."""
    angle_min: float32 = 0.0
    """Of the first ray, rad."""
    angle_max: float32 = 0.0
    """Of the last ray, rad."""
    angle_increment: float32 = 0.0
    """From one ray to the next, rad."""
    time_increment: float32 = 0.0
    """From one ray to the next, s; needed where the scanner moves."""
    scan_time: float32 = 0.0
    """From one sweep to the next, s."""
    range_min: float32 = 0.0
    """m; what is nearer is to be ignored."""
    range_max: float32 = 0.0
    """m; what is farther is to be ignored."""
    ranges: Float32Array = zeros()
    """m, ray by ray."""
    intensities: Float32Array = zeros()
    """How strong each echo was, in the device's own unit; empty if it is not measured."""


class LaserEcho(Message, package="sensor_msgs"):
    """All echoes of one ray, as part of a MultiEchoLaserScan."""

    echoes: Float32Array = zeros()
    """Ranges or intensities."""


class MultiEchoLaserScan(Message, package="sensor_msgs"):
    """One sweep of a planar laser scanner that sees several echoes per ray. Angles are those of LaserScan."""

    header: Header = Header()
    """`stamp` is when the first ray was measured."""
    angle_min: float32 = 0.0
    """Of the first ray, rad."""
    angle_max: float32 = 0.0
    """Of the last ray, rad."""
    angle_increment: float32 = 0.0
    """From one ray to the next, rad."""
    time_increment: float32 = 0.0
    """From one ray to the next, s; needed where the scanner moves."""
    scan_time: float32 = 0.0
    """From one sweep to the next, s."""
    range_min: float32 = 0.0
    """m; what is nearer is to be ignored."""
    range_max: float32 = 0.0
    """m; what is farther is to be ignored."""
    ranges: Sequence[LaserEcho] = ()
    """m, ray by ray; infinity is out of range, minus infinity too near to measure, NaN to be ignored."""
    intensities: Sequence[LaserEcho] = ()
    """How strong each echo was, in the device's own unit; empty if it is not measured."""


class Range(Message, package="sensor_msgs"):
    """One distance, valid somewhere in a cone about the x axis of the frame.

    A ranger that only tells whether something is within a fixed distance has `min_range` equal to `max_range`.
    """

    header: Header = Header()

    ULTRASOUND: ClassVar[uint8] = 0
    INFRARED: ClassVar[uint8] = 1

    radiation_type: uint8 = 0
    """What is sent out: one of the constants."""
    field_of_view: float32 = 0.0
    """The angle of the cone, rad; what was seen is within half of it to each side."""
    min_range: float32 = 0.0
    """m; what is nearer is to be ignored."""
    max_range: float32 = 0.0
    """m; what is farther is to be ignored."""
    range: float32 = 0.0
    """m; at a fixed distance minus infinity for something there, infinity for nothing."""
    variance: float32 = 0.0
    """m²; 0 means unknown."""
