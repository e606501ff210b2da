"""`geometry_msgs`: points, vectors, poses, velocities, forces and the transforms between frames; one file per kind.

Lengths are metres, angles radians, masses kilograms, forces newtons; frames are right-handed. A `…Stamped`
message adds the time and the frame; a `…WithCovariance` message adds how certain it is.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from busflow.msgs import read_on_demand

if TYPE_CHECKING:
    from busflow.msgs.geometry_msgs.forces import Inertia, InertiaStamped, Wrench, WrenchStamped
    from busflow.msgs.geometry_msgs.frames import Transform, TransformStamped
    from busflow.msgs.geometry_msgs.polygons import Polygon, PolygonInstance, PolygonInstanceStamped, PolygonStamped
    from busflow.msgs.geometry_msgs.poses import (
        Pose,
        Pose2D,
        PoseArray,
        PoseStamped,
        PoseWithCovariance,
        PoseWithCovarianceStamped,
    )
    from busflow.msgs.geometry_msgs.vectors import (
        Point,
        Point32,
        PointStamped,
        Quaternion,
        QuaternionStamped,
        Vector3,
        Vector3Stamped,
    )
    from busflow.msgs.geometry_msgs.velocities import (
        Accel,
        AccelStamped,
        AccelWithCovariance,
        AccelWithCovarianceStamped,
        Twist,
        TwistStamped,
        TwistWithCovariance,
        TwistWithCovarianceStamped,
        VelocityStamped,
    )

_KINDS = {
    "vectors": (
        "Vector3",
        "Point",
        "Point32",
        "Quaternion",
        "Vector3Stamped",
        "PointStamped",
        "QuaternionStamped",
    ),
    "poses": (
        "Pose",
        "Pose2D",
        "PoseWithCovariance",
        "PoseArray",
        "PoseStamped",
        "PoseWithCovarianceStamped",
    ),
    "velocities": (
        "Twist",
        "Accel",
        "TwistWithCovariance",
        "AccelWithCovariance",
        "TwistStamped",
        "TwistWithCovarianceStamped",
        "AccelStamped",
        "AccelWithCovarianceStamped",
        "VelocityStamped",
    ),
    "forces": (
        "Wrench",
        "Inertia",
        "WrenchStamped",
        "InertiaStamped",
    ),
    "frames": (
        "Transform",
        "TransformStamped",
    ),
    "polygons": (
        "Polygon",
        "PolygonInstance",
        "PolygonStamped",
        "PolygonInstanceStamped",
    ),
}
_HOMES = {name: kind for kind, names in _KINDS.items() for name in names}

__all__ = [
    "Accel",
    "AccelStamped",
    "AccelWithCovariance",
    "AccelWithCovarianceStamped",
    "Inertia",
    "InertiaStamped",
    "Point",
    "Point32",
    "PointStamped",
    "Polygon",
    "PolygonInstance",
    "PolygonInstanceStamped",
    "PolygonStamped",
    "Pose",
    "Pose2D",
    "PoseArray",
    "PoseStamped",
    "PoseWithCovariance",
    "PoseWithCovarianceStamped",
    "Quaternion",
    "QuaternionStamped",
    "Transform",
    "TransformStamped",
    "Twist",
    "TwistStamped",
    "TwistWithCovariance",
    "TwistWithCovarianceStamped",
    "Vector3",
    "Vector3Stamped",
    "VelocityStamped",
    "Wrench",
    "WrenchStamped",
]


__getattr__: Callable[[str], Any] = read_on_demand(__name__, _HOMES)  # a Vector3 needs no polygon


def __dir__() -> list[str]:
    return [*globals(), *__all__]
