"""`visualization_msgs`: 12 messages, 1 service, from its definition files."""

# busflow interface generate visualization_msgs --to busflow/msgs
# wrote this from visualization_msgs 5.4.2 (Apache License 2.0). Change its files instead, and run that again:
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
from busflow.msgs.builtin_interfaces import Duration
from busflow.msgs.geometry_msgs import Point, Pose, Quaternion, Vector3
from busflow.msgs.sensor_msgs import CompressedImage
from busflow.msgs.std_msgs import ColorRGBA, Header

__all__ = [
    "GetInteractiveMarkers",
    "ImageMarker",
    "InteractiveMarker",
    "InteractiveMarkerControl",
    "InteractiveMarkerFeedback",
    "InteractiveMarkerInit",
    "InteractiveMarkerPose",
    "InteractiveMarkerUpdate",
    "Marker",
    "MarkerArray",
    "MenuEntry",
    "MeshFile",
    "UVCoordinate",
]


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
    """Namespace which is used with the id to form a unique id."""
    id: int32 = 0
    """Unique id within the namespace."""
    type: int32 = 0
    """One of the above types, e.g. CIRCLE, LINE_STRIP, etc."""
    action: int32 = 0
    """Either ADD or REMOVE."""
    position: Point = Point()
    """Two-dimensional coordinate position, in pixel-coordinates."""
    scale: float32 = 0.0
    """The scale of the object, e.g. the diameter for a CIRCLE."""
    outline_color: ColorRGBA = ColorRGBA()
    """The outline color of the marker."""
    filled: uint8 = 0
    """Whether or not to fill in the shape with color."""
    fill_color: ColorRGBA = ColorRGBA()
    """Fill color; in the range: [0.0-1.0]"""
    lifetime: Duration = Duration()
    """How long the object should last before being automatically deleted.
    0 indicates forever.
    """
    points: Sequence[Point] = ()
    """Coordinates in 2D in pixel coords. Used for LINE_STRIP, LINE_LIST, POINTS, etc."""
    outline_colors: Sequence[ColorRGBA] = ()
    """The color for each line, point, etc. in the points field."""


class MenuEntry(Message, package="visualization_msgs"):
    """MenuEntry message.

    Each InteractiveMarker message has an array of MenuEntry messages.
    A collection of MenuEntries together describe a
    menu/submenu/subsubmenu/etc tree, though they are stored in a flat
    array.  The tree structure is represented by giving each menu entry
    an ID number and a "parent_id" field.  Top-level entries are the
    ones with parent_id = 0.  Menu entries are ordered within their
    level the same way they are ordered in the containing array.  Parent
    entries must appear before their children.

    Example:
    - id = 3
      parent_id = 0
      title = "fun"
    - id = 2
      parent_id = 0
      title = "robot"
    - id = 4
      parent_id = 2
      title = "pr2"
    - id = 5
      parent_id = 2
      title = "turtle"

    Gives a menu tree like this:
     - fun
     - robot
       - pr2
       - turtle
    """

    FEEDBACK: ClassVar[uint8] = 0
    """Command_type stores the type of response desired when this menu
    entry is clicked.
    FEEDBACK: send an InteractiveMarkerFeedback message with menu_entry_id set to this entry's id.
    ROSRUN: execute "rosrun" with arguments given in the command field (above).
    ROSLAUNCH: execute "roslaunch" with arguments given in the command field (above).
    """
    ROSRUN: ClassVar[uint8] = 1
    ROSLAUNCH: ClassVar[uint8] = 2

    id: uint32 = 0
    """ID is a number for each menu entry.  Must be unique within the
    control, and should never be 0.
    """
    parent_id: uint32 = 0
    """ID of the parent of this menu entry, if it is a submenu.  If this
    menu entry is a top-level entry, set parent_id to 0.
    """
    title: str = ""
    """menu / entry title"""
    command: str = ""
    """Arguments to command indicated by command_type (below)"""
    command_type: uint8 = 0


class UVCoordinate(Message, package="visualization_msgs"):
    """Location of the pixel as a ratio of the width of a 2D texture.
    Values should be in range: [0.0-1.0].
    """

    u: float32 = 0.0
    v: float32 = 0.0


class MeshFile(Message, package="visualization_msgs"):
    """Used to send raw mesh files."""

    filename: str = ""
    """The filename is used for both debug purposes and to provide a file extension
    for whatever parser is used.
    """
    data: UInt8Array = zeros()
    """This stores the raw text of the mesh file."""


class Marker(Message, package="visualization_msgs"):
    """See:
     - http://www.ros.org/wiki/rviz/DisplayTypes/Marker
     - http://www.ros.org/wiki/rviz/Tutorials/Markers%3A%20Basic%20Shapes

    for more information on using this message with rviz.
    """

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
    """Header for timestamp and frame id."""
    ns: str = ""
    """Namespace in which to place the object.
    Used in conjunction with id to create a unique name for the object.
    """
    id: int32 = 0
    """Object ID used in conjunction with the namespace for manipulating and deleting the object later."""
    type: int32 = 0
    """Type of object."""
    action: int32 = 0
    """Action to take; one of:
     - 0 add/modify an object
     - 1 (deprecated)
     - 2 deletes an object (with the given ns and id)
     - 3 deletes all objects (or those with the given ns if any)
    """
    pose: Pose = Pose()
    """Pose of the object with respect the frame_id specified in the header."""
    scale: Vector3 = Vector3()
    """Scale of the object; 1,1,1 means default (usually 1 meter square)."""
    color: ColorRGBA = ColorRGBA()
    """Color of the object; in the range: [0.0-1.0]"""
    lifetime: Duration = Duration()
    """How long the object should last before being automatically deleted.
    0 indicates forever.
    """
    frame_locked: bool = False
    """If this marker should be frame-locked, i.e. retransformed into its frame every timestep."""
    points: Sequence[Point] = ()
    """Only used if the type specified has some use for them (eg. POINTS, LINE_STRIP, ARROW_STRIP, etc.)"""
    colors: Sequence[ColorRGBA] = ()
    """Only used if the type specified has some use for them (eg. POINTS, LINE_STRIP, etc.)
    The number of colors provided must either be 0 or equal to the number of points provided.
    NOTE: alpha is not yet used
    """
    texture_resource: str = ""
    """Texture resource is a special URI that can either reference a texture file in
    a format acceptable to (resource retriever)[https://docs.ros.org/en/rolling/p/resource_retriever/]
    or an embedded texture via a string matching the format:
      "embedded://texture_name"
    """
    texture: CompressedImage = CompressedImage()
    """An image to be loaded into the rendering engine as the texture for this marker.
    This will be used iff texture_resource is set to embedded.
    """
    uv_coordinates: Sequence[UVCoordinate] = ()
    """Location of each vertex within the texture; in the range: [0.0-1.0]"""
    text: str = ""
    """Only used for text markers"""
    mesh_resource: str = ""
    """Only used for MESH_RESOURCE markers.
    Similar to texture_resource, mesh_resource uses resource retriever to load a mesh.
    Optionally, a mesh file can be sent in-message via the mesh_file field. If doing so,
    use the following format for mesh_resource:
      "embedded://mesh_name"
    """
    mesh_file: MeshFile = MeshFile()
    mesh_use_embedded_materials: bool = False


class InteractiveMarkerControl(Message, package="visualization_msgs"):
    """Represents a control that is to be displayed together with an interactive marker"""

    INHERIT: ClassVar[uint8] = 0
    """Orientation mode: controls how orientation changes.
    INHERIT: Follow orientation of interactive marker
    FIXED: Keep orientation fixed at initial state
    VIEW_FACING: Align y-z plane with screen (x: forward, y:left, z:up).
    """
    FIXED: ClassVar[uint8] = 1
    VIEW_FACING: ClassVar[uint8] = 2
    NONE: ClassVar[uint8] = 0
    """Interaction mode for this control

    NONE: This control is only meant for visualization; no context menu.
    MENU: Like NONE, but right-click menu is active.
    BUTTON: Element can be left-clicked.
    MOVE_AXIS: Translate along local x-axis.
    MOVE_PLANE: Translate in local y-z plane.
    ROTATE_AXIS: Rotate around local x-axis.
    MOVE_ROTATE: Combines MOVE_PLANE and ROTATE_AXIS.
    """
    MENU: ClassVar[uint8] = 1
    BUTTON: ClassVar[uint8] = 2
    MOVE_AXIS: ClassVar[uint8] = 3
    MOVE_PLANE: ClassVar[uint8] = 4
    ROTATE_AXIS: ClassVar[uint8] = 5
    MOVE_ROTATE: ClassVar[uint8] = 6
    MOVE_3D: ClassVar[uint8] = 7
    """"3D" interaction modes work with the mouse+SHIFT+CTRL or with 3D cursors.
    MOVE_3D: Translate freely in 3D space.
    ROTATE_3D: Rotate freely in 3D space about the origin of parent frame.
    MOVE_ROTATE_3D: Full 6-DOF freedom of translation and rotation about the cursor origin.
    """
    ROTATE_3D: ClassVar[uint8] = 8
    MOVE_ROTATE_3D: ClassVar[uint8] = 9

    name: str = ""
    """Identifying string for this control.
    You need to assign a unique value to this to receive feedback from the GUI
    on what actions the user performs on this control (e.g. a button click).
    """
    orientation: Quaternion = Quaternion()
    """Defines the local coordinate frame (relative to the pose of the parent
    interactive marker) in which is being rotated and translated.
    Default: Identity
    """
    orientation_mode: uint8 = 0
    interaction_mode: uint8 = 0
    always_visible: bool = False
    """If true, the contained markers will also be visible
    when the gui is not in interactive mode.
    """
    markers: Sequence[Marker] = ()
    """Markers to be displayed as custom visual representation.
    Leave this empty to use the default control handles.

    Note:
    - The markers can be defined in an arbitrary coordinate frame,
      but will be transformed into the local frame of the interactive marker.
    - If the header of a marker is empty, its pose will be interpreted as
      relative to the pose of the parent interactive marker.
    """
    independent_marker_orientation: bool = False
    """In VIEW_FACING mode, set this to true if you don't want the markers
    to be aligned with the camera view point. The markers will show up
    as in INHERIT mode.
    """
    description: str = ""
    """Short description (< 40 characters) of what this control does,
    e.g. "Move the robot".
    Default: A generic description based on the interaction mode
    """


class InteractiveMarker(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/InteractiveMarker`."""

    header: Header = Header()
    """Time/frame info.
    If header.time is set to 0, the marker will be retransformed into
    its frame on each timestep. You will receive the pose feedback
    in the same frame.
    Otherwise, you might receive feedback in a different frame.
    For rviz, this will be the current 'fixed frame' set by the user.
    """
    pose: Pose = Pose()
    """Initial pose. Also, defines the pivot point for rotations."""
    name: str = ""
    """Identifying string. Must be globally unique in
    the topic that this message is sent through.
    """
    description: str = ""
    """Short description (< 40 characters)."""
    scale: float32 = 0.0
    """Scale to be used for default controls (default=1)."""
    menu_entries: Sequence[MenuEntry] = ()
    """All menu and submenu entries associated with this marker."""
    controls: Sequence[InteractiveMarkerControl] = ()
    """List of controls displayed for this marker."""


class InteractiveMarkerFeedback(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/InteractiveMarkerFeedback`."""

    KEEP_ALIVE: ClassVar[uint8] = 0
    """Type of the event
    KEEP_ALIVE: sent while dragging to keep up control of the marker
    MENU_SELECT: a menu entry has been selected
    BUTTON_CLICK: a button control has been clicked
    POSE_UPDATE: the pose has been changed using one of the controls
    """
    POSE_UPDATE: ClassVar[uint8] = 1
    MENU_SELECT: ClassVar[uint8] = 2
    BUTTON_CLICK: ClassVar[uint8] = 3
    MOUSE_DOWN: ClassVar[uint8] = 4
    MOUSE_UP: ClassVar[uint8] = 5

    header: Header = Header()
    """Time/frame info."""
    client_id: str = ""
    """Identifying string. Must be unique in the topic namespace."""
    marker_name: str = ""
    """Feedback message sent back from the GUI, e.g.
    when the status of an interactive marker was modified by the user.

    Specifies which interactive marker and control this message refers to
    """
    control_name: str = ""
    event_type: uint8 = 0
    pose: Pose = Pose()
    """Current pose of the marker
    Note: Has to be valid for all feedback types.
    """
    menu_entry_id: uint32 = 0
    """Contains the ID of the selected menu entry
    Only valid for MENU_SELECT events.
    """
    mouse_point: Point = Point()
    """If event_type is BUTTON_CLICK, MOUSE_DOWN, or MOUSE_UP, mouse_point
    may contain the 3 dimensional position of the event on the
    control.  If it does, mouse_point_valid will be true.  mouse_point
    will be relative to the frame listed in the header.
    """
    mouse_point_valid: bool = False


class InteractiveMarkerInit(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/InteractiveMarkerInit`."""

    server_id: str = ""
    """Identifying string. Must be unique in the topic namespace
    that this server works on.
    """
    seq_num: uint64 = 0
    """Sequence number.
    The client will use this to detect if it has missed a subsequent
    update.  Every update message will have the same sequence number as
    an init message.  Clients will likely want to unsubscribe from the
    init topic after a successful initialization to avoid receiving
    duplicate data.
    """
    markers: Sequence[InteractiveMarker] = ()
    """All markers."""


class InteractiveMarkerPose(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/InteractiveMarkerPose`."""

    header: Header = Header()
    """Time/frame info."""
    pose: Pose = Pose()
    """Initial pose. Also, defines the pivot point for rotations."""
    name: str = ""
    """Identifying string. Must be globally unique in
    the topic that this message is sent through.
    """


class InteractiveMarkerUpdate(Message, package="visualization_msgs"):
    """The message `visualization_msgs/msg/InteractiveMarkerUpdate`."""

    KEEP_ALIVE: ClassVar[uint8] = 0
    """Type holds the purpose of this message.  It must be one of UPDATE or KEEP_ALIVE.
    UPDATE: Incremental update to previous state.
            The sequence number must be 1 higher than for
            the previous update.
    KEEP_ALIVE: Indicates the that the server is still living.
                The sequence number does not increase.
                No payload data should be filled out (markers, poses, or erases).
    """
    UPDATE: ClassVar[uint8] = 1

    server_id: str = ""
    """Identifying string. Must be unique in the topic namespace
    that this server works on.
    """
    seq_num: uint64 = 0
    """Sequence number.
    The client will use this to detect if it has missed an update.
    """
    type: uint8 = 0
    markers: Sequence[InteractiveMarker] = ()
    """Note: No guarantees on the order of processing.
          Contents must be kept consistent by sender.

    Markers to be added or updated
    """
    poses: Sequence[InteractiveMarkerPose] = ()
    """Poses of markers that should be moved"""
    erases: Sequence[str] = ()
    """Names of markers to be erased"""


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
        """Sequence number.
        Set to the sequence number of the latest update message
        at the time the server received the request.
        Clients use this to detect if any updates were missed.
        """
        markers: Sequence[InteractiveMarker] = ()
        """All interactive markers provided by the server."""
