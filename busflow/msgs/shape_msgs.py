"""`shape_msgs`: 4 messages, from its definition files."""

# busflow interface generate shape_msgs --to busflow/msgs
# wrote this from shape_msgs 5.4.2 (Apache License 2.0). Change its files instead, and run that again:
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
    """Definition of a triangle's vertices."""

    vertex_indices: Annotated[UInt32Array, Length(3)] = zeros(3)


class Mesh(Message, package="shape_msgs"):
    """Definition of a mesh."""

    triangles: Sequence[MeshTriangle] = ()
    """List of triangles; the index values refer to positions in vertices[]."""
    vertices: Sequence[Point] = ()
    """The actual vertices that make up the mesh."""


class Plane(Message, package="shape_msgs"):
    """Representation of a plane, using the plane equation ax + by + cz + d = 0.

    a := coef[0]
    b := coef[1]
    c := coef[2]
    d := coef[3]
    """

    coef: Annotated[Float64Array, Length(4)] = zeros(4)


class SolidPrimitive(Message, package="shape_msgs"):
    """Defines box, sphere, cylinder, cone and prism.
    All shapes are defined to have their bounding boxes centered around 0,0,0.
    """

    BOX: ClassVar[uint8] = 1
    SPHERE: ClassVar[uint8] = 2
    CYLINDER: ClassVar[uint8] = 3
    CONE: ClassVar[uint8] = 4
    PRISM: ClassVar[uint8] = 5
    BOX_X: ClassVar[uint8] = 0
    """The meaning of the shape dimensions: each constant defines the index in the 'dimensions' array.

    For type BOX, the X, Y, and Z dimensions are the length of the corresponding sides of the box.
    """
    BOX_Y: ClassVar[uint8] = 1
    BOX_Z: ClassVar[uint8] = 2
    SPHERE_RADIUS: ClassVar[uint8] = 0
    """For the SPHERE type, only one component is used, and it gives the radius of the sphere."""
    CYLINDER_HEIGHT: ClassVar[uint8] = 0
    """For the CYLINDER and CONE types, the center line is oriented along the Z axis.
    Therefore the CYLINDER_HEIGHT (CONE_HEIGHT) component of dimensions gives the
    height of the cylinder (cone).
    The CYLINDER_RADIUS (CONE_RADIUS) component of dimensions gives the radius of
    the base of the cylinder (cone).
    Cone and cylinder primitives are defined to be circular. The tip of the cone
    is pointing up, along +Z axis.
    """
    CYLINDER_RADIUS: ClassVar[uint8] = 1
    CONE_HEIGHT: ClassVar[uint8] = 0
    CONE_RADIUS: ClassVar[uint8] = 1
    PRISM_HEIGHT: ClassVar[uint8] = 0
    """For the type PRISM, the center line is oriented along Z axis.
    The PRISM_HEIGHT component of dimensions gives the
    height of the prism.
    The polygon defines the Z axis centered base of the prism.
    The prism is constructed by extruding the base in +Z and -Z
    directions by half of the PRISM_HEIGHT
    Only x and y fields of the points are used in the polygon.
    Points of the polygon are ordered counter-clockwise.
    """

    type: uint8 = 0
    """The type of the shape"""
    dimensions: Annotated[Float64Array, Length(max=3)] = zeros()
    """The dimensions of the shape

    At no point will dimensions have a length > 3.
    """
    polygon: Polygon = Polygon()
