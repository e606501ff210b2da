"""Polygons: outlines in a plane."""

from collections.abc import Sequence

from busflow.interfaces.message import Message, int64
from busflow.msgs.geometry_msgs.vectors import Point32
from busflow.msgs.std_msgs import Header


class Polygon(Message, package="geometry_msgs"):
    """A closed outline: the last point joins the first."""

    points: Sequence[Point32] = ()


class PolygonInstance(Message, package="geometry_msgs"):
    """A polygon with an identifier."""

    polygon: Polygon = Polygon()
    id: int64 = 0


class PolygonStamped(Message, package="geometry_msgs"):
    """A polygon with its time and frame."""

    header: Header = Header()
    polygon: Polygon = Polygon()


class PolygonInstanceStamped(Message, package="geometry_msgs"):
    """A polygon of its own identity with its time and frame."""

    header: Header = Header()
    polygon: PolygonInstance = PolygonInstance()
