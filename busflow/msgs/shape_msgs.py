"""`shape_msgs`: 4 messages, from its definition files."""

# busflow interface generate shape_msgs --to busflow/msgs
# wrote this from shape_msgs 5.4.2 (Apache License 2.0). The comments of its files are left out. The files:
#   msg/Mesh.msg            RIHS01_f2150b82d8ee7e8bc3f396a2b158aefb4b9a5510a474be271ba1268aebb55289
#   msg/MeshTriangle.msg    RIHS01_618e5c073eeb729e433ef6226e72c01d995c459fb7d76348c9700409a5020bd0
#   msg/Plane.msg           RIHS01_dfbfe8314689c850615d4a727af017e9aa86c10e369a606c8c851ef8f16c58c8
#   msg/SolidPrimitive.msg  RIHS01_2802a15190aadc3f496584df4b0b4c5824d8a0b31aaef839faa75bc34dda38ac

from collections.abc import Sequence
from typing import Annotated, ClassVar

from busflow.interfaces.message import Float64Array, Length, Message, UInt32Array, uint8, zeros
from busflow.msgs.geometry_msgs import Point, Polygon

__all__ = ["Mesh", "MeshTriangle", "Plane", "SolidPrimitive"]


class MeshTriangle(Message, package="shape_msgs"):
    """The message `shape_msgs/msg/MeshTriangle`."""

    vertex_indices: Annotated[UInt32Array, Length(3)] = zeros(3)


class Mesh(Message, package="shape_msgs"):
    """The message `shape_msgs/msg/Mesh`."""

    triangles: Sequence[MeshTriangle] = ()
    vertices: Sequence[Point] = ()


class Plane(Message, package="shape_msgs"):
    """The message `shape_msgs/msg/Plane`."""

    coef: Annotated[Float64Array, Length(4)] = zeros(4)


class SolidPrimitive(Message, package="shape_msgs"):
    """The message `shape_msgs/msg/SolidPrimitive`."""

    BOX: ClassVar[uint8] = 1
    SPHERE: ClassVar[uint8] = 2
    CYLINDER: ClassVar[uint8] = 3
    CONE: ClassVar[uint8] = 4
    PRISM: ClassVar[uint8] = 5
    BOX_X: ClassVar[uint8] = 0
    BOX_Y: ClassVar[uint8] = 1
    BOX_Z: ClassVar[uint8] = 2
    SPHERE_RADIUS: ClassVar[uint8] = 0
    CYLINDER_HEIGHT: ClassVar[uint8] = 0
    CYLINDER_RADIUS: ClassVar[uint8] = 1
    CONE_HEIGHT: ClassVar[uint8] = 0
    CONE_RADIUS: ClassVar[uint8] = 1
    PRISM_HEIGHT: ClassVar[uint8] = 0

    type: uint8 = 0
    dimensions: Annotated[Float64Array, Length(max=3)] = zeros()
    polygon: Polygon = Polygon()
