"""`visualization_msgs`: 12 messages, 1 service, from its definition files."""

# busflow interface generate visualization_msgs --to busflow/msgs
# wrote this from visualization_msgs 5.4.2 (Apache License 2.0). The comments of its files are left out. The files:
#   msg/ImageMarker.msg                RIHS01_603152491ef2331c200a5305230d31f6e8704875944b388da0f547c415d11836
#   msg/InteractiveMarker.msg          RIHS01_3d5b51448b51d73b0f395b94d259edd3a5d269ae9f7d9fd5cceb9ae4b72be346
#   msg/InteractiveMarkerControl.msg   RIHS01_60e2fa36344f5f4791b24a809542a18bffd555f563550d4b22b3bbfc31ec0ed5
#   msg/InteractiveMarkerFeedback.msg  RIHS01_6cc48741df9f05d19ba7d9ea3101e9fcd1309c9d6bda3c55668ba607492f725e
#   msg/InteractiveMarkerInit.msg      RIHS01_23fda1b3373b154d9d6408dd7b9f8129b2a2b76b905ee421e8c4109d8bf71f78
#   msg/InteractiveMarkerPose.msg      RIHS01_c60e9a4407d5f709a63e0fe9caea324aee08fe717cd090209ebe35012ce7cb66
#   msg/InteractiveMarkerUpdate.msg    RIHS01_0a8b000c4fd4d50876ac716a7de018911599a2f015795388e956a2ca8b0c54f0
#   msg/Marker.msg                     RIHS01_45b13ccf791f225962bf74e746f9644518855d783a6f42ba0cc14fde2b4f3ce0
#   msg/MarkerArray.msg                RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf
#   msg/MenuEntry.msg                  RIHS01_22170c387c70fd4236232ec902de8604e72ff027342c7c0f28ad9f68c64c51d6
#   msg/MeshFile.msg                   RIHS01_7710ece15a148fb7c9b546364cfb215bb06098087bd6394fe5b73a493508f8c4
#   msg/UVCoordinate.msg               RIHS01_f27f7ed21fe360c6066944f856b801a0c0d1e94e815b6886444b42d90b196a26
#   srv/GetInteractiveMarkers.srv      RIHS01_bfdfaa861f4a8422b4ec3bd02c6681e4a45a83bdc2913d8facdf923d8ad1376a

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.message import Message, ServiceType, UInt8Array, float32, int32, uint8, uint32, uint64, zeros
from busflow.msgs import export_types
from busflow.msgs.builtin_interfaces import Duration
from busflow.msgs.geometry_msgs import Point, Pose, Quaternion, Vector3
from busflow.msgs.sensor_msgs import CompressedImage
from busflow.msgs.std_msgs import ColorRGBA, Header


class ImageMarker(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/ImageMarker`."""

    CIRCLE: ClassVar[int32] = 0
    LINE_STRIP: ClassVar[int32] = 1
    LINE_LIST: ClassVar[int32] = 2
    POLYGON: ClassVar[int32] = 3
    POINTS: ClassVar[int32] = 4
    ADD: ClassVar[int32] = 0
    REMOVE: ClassVar[int32] = 1

    header: Header = Header()
    ns: str = ""
    id: int32 = 0
    type: int32 = 0
    action: int32 = 0
    position: Point = Point()
    scale: float32 = 0.0
    outline_color: ColorRGBA = ColorRGBA()
    filled: uint8 = 0
    fill_color: ColorRGBA = ColorRGBA()
    lifetime: Duration = Duration()
    points: Sequence[Point] = ()
    outline_colors: Sequence[ColorRGBA] = ()


class MenuEntry(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/MenuEntry`."""

    FEEDBACK: ClassVar[uint8] = 0
    ROSRUN: ClassVar[uint8] = 1
    ROSLAUNCH: ClassVar[uint8] = 2

    id: uint32 = 0
    parent_id: uint32 = 0
    title: str = ""
    command: str = ""
    command_type: uint8 = 0


class UVCoordinate(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/UVCoordinate`."""

    u: float32 = 0.0
    v: float32 = 0.0


class MeshFile(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/MeshFile`."""

    filename: str = ""
    data: UInt8Array = zeros()


class Marker(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/Marker`."""

    ARROW: ClassVar[int32] = 0
    CUBE: ClassVar[int32] = 1
    SPHERE: ClassVar[int32] = 2
    CYLINDER: ClassVar[int32] = 3
    LINE_STRIP: ClassVar[int32] = 4
    LINE_LIST: ClassVar[int32] = 5
    CUBE_LIST: ClassVar[int32] = 6
    SPHERE_LIST: ClassVar[int32] = 7
    POINTS: ClassVar[int32] = 8
    TEXT_VIEW_FACING: ClassVar[int32] = 9
    MESH_RESOURCE: ClassVar[int32] = 10
    TRIANGLE_LIST: ClassVar[int32] = 11
    ARROW_STRIP: ClassVar[int32] = 12
    ADD: ClassVar[int32] = 0
    MODIFY: ClassVar[int32] = 0
    DELETE: ClassVar[int32] = 2
    DELETEALL: ClassVar[int32] = 3

    header: Header = Header()
    ns: str = ""
    id: int32 = 0
    type: int32 = 0
    action: int32 = 0
    pose: Pose = Pose()
    scale: Vector3 = Vector3()
    color: ColorRGBA = ColorRGBA()
    lifetime: Duration = Duration()
    frame_locked: bool = False
    points: Sequence[Point] = ()
    colors: Sequence[ColorRGBA] = ()
    texture_resource: str = ""
    texture: CompressedImage = CompressedImage()
    uv_coordinates: Sequence[UVCoordinate] = ()
    text: str = ""
    mesh_resource: str = ""
    mesh_file: MeshFile = MeshFile()
    mesh_use_embedded_materials: bool = False


class InteractiveMarkerControl(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/InteractiveMarkerControl`."""

    INHERIT: ClassVar[uint8] = 0
    FIXED: ClassVar[uint8] = 1
    VIEW_FACING: ClassVar[uint8] = 2
    NONE: ClassVar[uint8] = 0
    MENU: ClassVar[uint8] = 1
    BUTTON: ClassVar[uint8] = 2
    MOVE_AXIS: ClassVar[uint8] = 3
    MOVE_PLANE: ClassVar[uint8] = 4
    ROTATE_AXIS: ClassVar[uint8] = 5
    MOVE_ROTATE: ClassVar[uint8] = 6
    MOVE_3D: ClassVar[uint8] = 7
    ROTATE_3D: ClassVar[uint8] = 8
    MOVE_ROTATE_3D: ClassVar[uint8] = 9

    name: str = ""
    orientation: Quaternion = Quaternion()
    orientation_mode: uint8 = 0
    interaction_mode: uint8 = 0
    always_visible: bool = False
    markers: Sequence[Marker] = ()
    independent_marker_orientation: bool = False
    description: str = ""


class InteractiveMarker(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/InteractiveMarker`."""

    header: Header = Header()
    pose: Pose = Pose()
    name: str = ""
    description: str = ""
    scale: float32 = 0.0
    menu_entries: Sequence[MenuEntry] = ()
    controls: Sequence[InteractiveMarkerControl] = ()


class InteractiveMarkerFeedback(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/InteractiveMarkerFeedback`."""

    KEEP_ALIVE: ClassVar[uint8] = 0
    POSE_UPDATE: ClassVar[uint8] = 1
    MENU_SELECT: ClassVar[uint8] = 2
    BUTTON_CLICK: ClassVar[uint8] = 3
    MOUSE_DOWN: ClassVar[uint8] = 4
    MOUSE_UP: ClassVar[uint8] = 5

    header: Header = Header()
    client_id: str = ""
    marker_name: str = ""
    control_name: str = ""
    event_type: uint8 = 0
    pose: Pose = Pose()
    menu_entry_id: uint32 = 0
    mouse_point: Point = Point()
    mouse_point_valid: bool = False


class InteractiveMarkerInit(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/InteractiveMarkerInit`."""

    server_id: str = ""
    seq_num: uint64 = 0
    markers: Sequence[InteractiveMarker] = ()


class InteractiveMarkerPose(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/InteractiveMarkerPose`."""

    header: Header = Header()
    pose: Pose = Pose()
    name: str = ""


class InteractiveMarkerUpdate(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/InteractiveMarkerUpdate`."""

    KEEP_ALIVE: ClassVar[uint8] = 0
    UPDATE: ClassVar[uint8] = 1

    server_id: str = ""
    seq_num: uint64 = 0
    type: uint8 = 0
    markers: Sequence[InteractiveMarker] = ()
    poses: Sequence[InteractiveMarkerPose] = ()
    erases: Sequence[str] = ()


class MarkerArray(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/MarkerArray`."""

    markers: Sequence[Marker] = ()


class GetInteractiveMarkers(ServiceType, package="visualization_msgs"):
    """The service `visualization_msgs/srv/GetInteractiveMarkers`."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        sequence_number: uint64 = 0
        markers: Sequence[InteractiveMarker] = ()


export_types(globals())
