"""Forces, and the masses that they move."""

from busflow.interfaces.message import Message, float64
from busflow.msgs.geometry_msgs.vectors import Vector3
from busflow.msgs.std_msgs import Header


class Wrench(Message, package="geometry_msgs"):
    """A force and a torque on a body."""

    force: Vector3 = Vector3()
    """Along the axes, N."""
    torque: Vector3 = Vector3()
    """About the axes, N·m."""


class Inertia(Message, package="geometry_msgs"):
    """The mass of a body and its distribution."""

    m: float64 = 0.0
    """The mass, kg."""
    com: Vector3 = Vector3()
    """The centre of mass, m."""
    ixx: float64 = 0.0
    """The entries of the symmetric inertia tensor are about the centre of mass, kg·m²."""
    ixy: float64 = 0.0
    ixz: float64 = 0.0
    iyy: float64 = 0.0
    iyz: float64 = 0.0
    izz: float64 = 0.0


class WrenchStamped(Message, package="geometry_msgs"):
    """A wrench with its time and frame."""

    header: Header = Header()
    wrench: Wrench = Wrench()


class InertiaStamped(Message, package="geometry_msgs"):
    """An inertia with its time and frame."""

    header: Header = Header()
    inertia: Inertia = Inertia()
