"""`nav_msgs`: maps, odometry, paths and the services around them."""

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.message import Int8Array, Message, ServiceType, float32, uint8, uint32, zeros
from busflow.msgs import export_types
from busflow.msgs.builtin_interfaces import Time
from busflow.msgs.geometry_msgs import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    TwistWithCovariance,
)
from busflow.msgs.std_msgs import Header


class Goals(Message, package="nav_msgs"):
    """Poses to reach."""

    header: Header = Header()
    goals: Sequence[PoseStamped] = ()


class GridCells(Message, package="nav_msgs"):
    """Some cells of a plane grid."""

    header: Header = Header()
    cell_width: float32 = 0.0
    """m."""
    cell_height: float32 = 0.0
    """m."""
    cells: Sequence[Point] = ()
    """The centre of each."""


class MapMetaData(Message, package="nav_msgs"):
    """The size and position of a grid in the world."""

    map_load_time: Time = Time()
    """The time at which the map was loaded."""
    resolution: float32 = 0.0
    """The side of a cell, m."""
    width: uint32 = 0
    """Cells along x."""
    height: uint32 = 0
    """Cells along y."""
    origin: Pose = Pose()
    """The pose of the lower left corner of cell (0, 0)."""


class OccupancyGrid(Message, package="nav_msgs"):
    """A map of free and occupied cells."""

    header: Header = Header()
    info: MapMetaData = MapMetaData()
    data: Int8Array = zeros()
    """Cell (x, y) at `y * info.width + x`: 0 free to 100 occupied, -1 unknown."""


class Odometry(Message, package="nav_msgs"):
    """The pose and velocity of a body."""

    header: Header = Header()
    """`frame_id` is the frame of the pose."""
    child_frame_id: str = ""
    """The frame of the body, in which the twist is."""
    pose: PoseWithCovariance = PoseWithCovariance()
    twist: TwistWithCovariance = TwistWithCovariance()


class Path(Message, package="nav_msgs"):
    """Poses to go through one after another."""

    header: Header = Header()
    poses: Sequence[PoseStamped] = ()


class GetMap(ServiceType, package="nav_msgs"):
    """Asks for the map."""

    class Request(Message):
        """Nothing."""

    class Response(Message):
        """The map as it is now."""

        map: OccupancyGrid = OccupancyGrid()


class GetPlan(ServiceType, package="nav_msgs"):
    """Asks for a path."""

    class Request(Message):
        """The start and the goal."""

        start: PoseStamped = PoseStamped()
        goal: PoseStamped = PoseStamped()
        tolerance: float32 = 0.0
        """How far from the goal, in x and y, the path may end where the goal is blocked, m."""

    class Response(Message):
        """The path; empty where there is none."""

        plan: Path = Path()


class LoadMap(ServiceType, package="nav_msgs"):
    """Asks a map server to load a map."""

    class Request(Message):
        """The map to load."""

        map_url: str = ""
        """`file:///maps/floor1.yaml`, or `package://my_robot/maps/floor1.yaml` in a ROS package."""

    class Response(Message):
        """The result."""

        RESULT_SUCCESS: ClassVar[uint8] = 0
        RESULT_MAP_DOES_NOT_EXIST: ClassVar[uint8] = 1
        RESULT_INVALID_MAP_DATA: ClassVar[uint8] = 2
        RESULT_INVALID_MAP_METADATA: ClassVar[uint8] = 3
        RESULT_UNDEFINED_FAILURE: ClassVar[uint8] = 255

        map: OccupancyGrid = OccupancyGrid()
        """Valid only with RESULT_SUCCESS."""
        result: uint8 = 0
        """One of the constants."""


class SetMap(ServiceType, package="nav_msgs"):
    """Gives a localiser a map and a place on it."""

    class Request(Message):
        """The map, and roughly where the robot is."""

        map: OccupancyGrid = OccupancyGrid()
        initial_pose: PoseWithCovarianceStamped = PoseWithCovarianceStamped()

    class Response(Message):
        """Whether it took the map."""

        success: bool = False


export_types(globals())
