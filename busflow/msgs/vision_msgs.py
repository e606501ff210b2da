"""`vision_msgs`: 16 messages, from its definition files."""

# busflow interface generate vision_msgs --to busflow/msgs
# wrote this from vision_msgs 4.1.1 (Apache License 2.0). Change its files instead, and run that again:
#   msg/BoundingBox2D.msg             RIHS01_008eacbb0cf8f26e83795547bed013eec3675485ef386ec056d80eaaf1c1ce2f
#   msg/BoundingBox2DArray.msg        RIHS01_2464e82838009386d371b523211c21c91d74d313fcdd6788223c531d621cf691
#   msg/BoundingBox3D.msg             RIHS01_bbb73a65c163d7f9bb29009c7bde9f7faa576bd2d23299c4511d19230dab4698
#   msg/BoundingBox3DArray.msg        RIHS01_a81938db9576b10c2eecd7c5a5da3eac496efd00221b25ed051dfbc81fb56da6
#   msg/Classification.msg            RIHS01_f74db28d0eaef3afb78f48bf2161cd709a1383a0309d3454383b25be11345143
#   msg/Detection2D.msg               RIHS01_0d12b69df5c593b3455b7346fac8205437a7d4bcb09b9e0e0b2dde787ded38ea
#   msg/Detection2DArray.msg          RIHS01_214274120007f4a683866481336b70310268cfa107aebe9d594a6acf75bda968
#   msg/Detection3D.msg               RIHS01_ddd703be132ab0b69d33121f1bb034132bfbb3b0ac5f9fb1516005ba1c8a265b
#   msg/Detection3DArray.msg          RIHS01_793f5eab9595ac1c0da07873cc859db42eae51f0ee76056db8562515d830e018
#   msg/LabelInfo.msg                 RIHS01_3d37df4015cdf660cc851c51897f2acd957e1ca6205ba0a99aebffb9406b0783
#   msg/ObjectHypothesis.msg          RIHS01_51da43cec11c01957a64d1e05a24acd18aae7745ec30b74348ad5f6d634f7f90
#   msg/ObjectHypothesisWithPose.msg  RIHS01_41c12344c0396c48b81df12467c192d99b2a0eb1463c5c37194e4223251c80bc
#   msg/Point2D.msg                   RIHS01_eab0e83f44ab4de92ceaf76dd7d0e7638f2bdd1d16ffbe16c7a136c48e407247
#   msg/Pose2D.msg                    RIHS01_b0b5d1d7b4c20dd4fcde3ed1d4b289a919290572007d67a97043814db25d3648
#   msg/VisionClass.msg               RIHS01_1e4a11f0fed50b5623cb8ff26ca0e37952a48a9c074d16f804b44e9164c2037a
#   msg/VisionInfo.msg                RIHS01_95d3116a17484ad91c9a2686e1d54890bbfc3ff6c6a2de137738c4950d45d284

from collections.abc import Sequence

from busflow.interfaces.message import Message, float32, float64, int32, uint16
from busflow.msgs.geometry_msgs import Pose, PoseWithCovariance, Vector3
from busflow.msgs.std_msgs import Header

__all__ = [
    "BoundingBox2D",
    "BoundingBox2DArray",
    "BoundingBox3D",
    "BoundingBox3DArray",
    "Classification",
    "Detection2D",
    "Detection2DArray",
    "Detection3D",
    "Detection3DArray",
    "LabelInfo",
    "ObjectHypothesis",
    "ObjectHypothesisWithPose",
    "Point2D",
    "Pose2D",
    "VisionClass",
    "VisionInfo",
]


class Point2D(Message, package="vision_msgs"):
    """Represents a 2D point in pixel coordinates.
    XY matches the sensor_msgs/Image convention: X is positive right and Y is positive down.
    """

    x: float64 = 0.0
    y: float64 = 0.0


class Pose2D(Message, package="vision_msgs"):
    """Represents a 2D pose (coordinates and a radian rotation). Rotation is positive counterclockwise."""

    position: Point2D = Point2D()
    theta: float64 = 0.0


class BoundingBox2D(Message, package="vision_msgs"):
    """A 2D bounding box that can be rotated about its center.
    All dimensions are in pixels, but represented using floating-point
      values to allow sub-pixel precision. If an exact pixel crop is required
      for a rotated bounding box, it can be calculated using Bresenham's line
      algorithm.
    """

    center: Pose2D = Pose2D()
    """The 2D position (in pixels) and orientation of the bounding box center."""
    size_x: float64 = 0.0
    """The total size (in pixels) of the bounding box surrounding the object relative
    to the pose of its center.
    """
    size_y: float64 = 0.0


class BoundingBox2DArray(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/BoundingBox2DArray`."""

    header: Header = Header()
    boxes: Sequence[BoundingBox2D] = ()


class BoundingBox3D(Message, package="vision_msgs"):
    """A 3D bounding box that can be positioned and rotated about its center (6 DOF)
    Dimensions of this box are in meters, and as such, it may be migrated to
      another package, such as geometry_msgs, in the future.
    """

    center: Pose = Pose()
    """The 3D position and orientation of the bounding box center"""
    size: Vector3 = Vector3()
    """The total size of the bounding box, in meters, surrounding the object's center
    pose.
    """


class BoundingBox3DArray(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/BoundingBox3DArray`."""

    header: Header = Header()
    boxes: Sequence[BoundingBox3D] = ()


class ObjectHypothesis(Message, package="vision_msgs"):
    """An object hypothesis that contains no pose information.
    If you would like to define an array of ObjectHypothesis messages,
      please see the Classification message type.
    """

    class_id: str = ""
    """The unique ID of the object class. To get additional information about
    this ID, such as its human-readable class name, listeners should perform a
    lookup in a metadata database. See vision_msgs/VisionInfo.msg for more detail.
    """
    score: float64 = 0.0
    """The probability or confidence value of the detected object. By convention,
    this value should lie in the range [0-1].
    """


class Classification(Message, package="vision_msgs"):
    """Defines a classification result.

    This result does not contain any position information. It is designed for
      classifiers, which simply provide class probabilities given an instance of
      source data (e.g., an image or a point cloud).

    Source data that generated this classification are not a part of the message.
    If you need to access them, use an exact or approximate time synchronizer in
    your code, as this message's header should match the header of the source
    data.
    """

    header: Header = Header()
    results: Sequence[ObjectHypothesis] = ()
    """A list of class probabilities. This list need not provide a probability for
    every possible class, just ones that are nonzero, or above some
    user-defined threshold.
    """


class ObjectHypothesisWithPose(Message, package="vision_msgs"):
    """An object hypothesis that contains pose information.
    If you would like to define an array of ObjectHypothesisWithPose messages,
      please see the Detection2D or Detection3D message types.
    """

    hypothesis: ObjectHypothesis = ObjectHypothesis()
    """The object hypothesis (ID and score)."""
    pose: PoseWithCovariance = PoseWithCovariance()
    """The 6D pose of the object hypothesis. This pose should be
      defined as the pose of some fixed reference point on the object, such as
      the geometric center of the bounding box, the center of mass of the
      object or the origin of a reference mesh of the object.
    Note that this pose is not stamped; frame information can be defined by
      parent messages.
    Also note that different classes predicted for the same input data may have
      different predicted 6D poses.
    """


class Detection2D(Message, package="vision_msgs"):
    """Defines a 2D detection result.

    This is similar to a 2D classification, but includes position information,
      allowing a classification result for a specific crop or image point to
      to be located in the larger image.

    Source data that generated this detection are not a part of the message.
    If you need to access them, use an exact or approximate time synchronizer in
    your code, as this message's header should match the header of the source
    data.
    """

    header: Header = Header()
    results: Sequence[ObjectHypothesisWithPose] = ()
    """Class probabilities"""
    bbox: BoundingBox2D = BoundingBox2D()
    """2D bounding box surrounding the object."""
    id: str = ""
    """ID used for consistency across multiple detection messages. Detections
    of the same object in different detection messages should have the same id.
    This field may be empty.
    """


class Detection2DArray(Message, package="vision_msgs"):
    """A list of 2D detections, for a multi-object 2D detector."""

    header: Header = Header()
    detections: Sequence[Detection2D] = ()
    """A list of the detected proposals. A multi-proposal detector might generate
    this list with many candidate detections generated from a single input.
    """


class Detection3D(Message, package="vision_msgs"):
    """Defines a 3D detection result.

    This extends a basic 3D classification by including the pose of the
    detected object.

    Source data that generated this classification are not a part of the message.
    If you need to access them, use an exact or approximate time synchronizer in
    your code, as this message's header should match the header of the source
    data.
    """

    header: Header = Header()
    results: Sequence[ObjectHypothesisWithPose] = ()
    """Class probabilities. Does not have to include hypotheses for all possible
    object ids, the scores for any ids not listed are assumed to be 0.
    """
    bbox: BoundingBox3D = BoundingBox3D()
    """3D bounding box surrounding the object."""
    id: str = ""
    """ID used for consistency across multiple detection messages. Detections
    of the same object in different detection messages should have the same id.
    This field may be empty.
    """


class Detection3DArray(Message, package="vision_msgs"):
    """A list of 3D detections, for a multi-object 3D detector."""

    header: Header = Header()
    detections: Sequence[Detection3D] = ()
    """A list of the detected proposals. A multi-proposal detector might generate
    this list with many candidate detections generated from a single input.
    """


class VisionClass(Message, package="vision_msgs"):
    """A key value pair that maps an integer class_id to a string class label
    in computer vision systems.
    """

    class_id: uint16 = 0
    """The int value that identifies the class.
    Elements identified with 65535, the maximum uint16 value are assumed
      to belong to the "UNLABELED" class. For vision pipelines using less
      than 255 classes the "UNLABELED" is the maximum value in the uint8
      range.
    """
    class_name: str = ""
    """The name of the class represented by the class_id"""


class LabelInfo(Message, package="vision_msgs"):
    """Provides meta-information about a visual pipeline.

    This message serves a similar purpose to sensor_msgs/CameraInfo, but instead
      of being tied to hardware, it represents information about a specific
      computer vision pipeline. This information stays constant (or relatively
      constant) over time, and so it is wasteful to send it with each individual
      result. By listening to these messages, subscribers will receive
      the context in which published vision messages are to be interpreted.
    Each vision pipeline should publish its LabelInfo messages to its own topic,
      in a manner similar to CameraInfo.
    This message is meant to allow converting data from vision pipelines that
      return id based classifications back to human readable string class names.
    """

    header: Header = Header()
    """Used for sequencing"""
    class_map: Sequence[VisionClass] = ()
    """An array of uint16 keys and string values containing the association
    between class identifiers and their names. According to the amount
    of classes and the datatype used to store their ids internally, the
    maxiumum class id allowed (65535 for uint16 and 255 for uint8) belongs to
    the "UNLABELED" class.
    """
    threshold: float32 = 0.0
    """The value between 0-1 used as confidence threshold for the inference."""


class VisionInfo(Message, package="vision_msgs"):
    """Provides meta-information about a visual pipeline.

    This message serves a similar purpose to sensor_msgs/CameraInfo, but instead
      of being tied to hardware, it represents information about a specific
      computer vision pipeline. This information stays constant (or relatively
      constant) over time, and so it is wasteful to send it with each individual
      result. By listening to these messages, subscribers will receive
      the context in which published vision messages are to be interpreted.
    Each vision pipeline should publish its VisionInfo messages to its own topic,
      in a manner similar to CameraInfo.
    """

    header: Header = Header()
    """Used for sequencing"""
    method: str = ""
    """Name of the vision pipeline. This should be a value that is meaningful to an
    outside user.
    """
    database_location: str = ""
    """Location where the metadata database is stored. The recommended location is
      as an XML string on the ROS parameter server, but the exact implementation
      and information is left up to the user.
    The database should store information attached to class ids. Each
      class id should map to an atomic, visually recognizable element. This
      definition is intentionally vague to allow extreme flexibility. The
      elements could be classes in a pixel segmentation algorithm, object classes
      in a detector, different people's faces in a face detection algorithm, etc.
      Vision pipelines report results in terms of numeric IDs, which map into
      this  database.
    The information stored in this database is, again, left up to the user. The
      database could be as simple as a map from ID to class name, or it could
      include information such as object meshes or colors to use for
      visualization.
    """
    database_version: int32 = 0
    """Metadata database version. This counter is incremented
    each time the pipeline begins using a new version of the database (useful
    in the case of online training or user modifications).
    The counter value can be monitored by listeners to ensure that the pipeline
    and the listener are using the same metadata.
    """
