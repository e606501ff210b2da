"""`vision_msgs`: 16 messages, from its definition files."""

# busflow interface generate vision_msgs --to busflow/msgs
# wrote this from vision_msgs 4.1.1 (Apache License 2.0). The comments of its files are left out. The files:
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
from busflow.msgs import export_types
from busflow.msgs.geometry_msgs import Pose, PoseWithCovariance, Vector3
from busflow.msgs.std_msgs import Header


class Point2D(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/Point2D`."""

    x: float64 = 0.0
    y: float64 = 0.0


class Pose2D(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/Pose2D`."""

    position: Point2D = Point2D()
    theta: float64 = 0.0


class BoundingBox2D(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/BoundingBox2D`."""

    center: Pose2D = Pose2D()
    size_x: float64 = 0.0
    size_y: float64 = 0.0


class BoundingBox2DArray(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/BoundingBox2DArray`."""

    header: Header = Header()
    boxes: Sequence[BoundingBox2D] = ()


class BoundingBox3D(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/BoundingBox3D`."""

    center: Pose = Pose()
    size: Vector3 = Vector3()


class BoundingBox3DArray(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/BoundingBox3DArray`."""

    header: Header = Header()
    boxes: Sequence[BoundingBox3D] = ()


class ObjectHypothesis(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/ObjectHypothesis`."""

    class_id: str = ""
    score: float64 = 0.0


class Classification(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/Classification`."""

    header: Header = Header()
    results: Sequence[ObjectHypothesis] = ()


class ObjectHypothesisWithPose(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/ObjectHypothesisWithPose`."""

    hypothesis: ObjectHypothesis = ObjectHypothesis()
    pose: PoseWithCovariance = PoseWithCovariance()


class Detection2D(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/Detection2D`."""

    header: Header = Header()
    results: Sequence[ObjectHypothesisWithPose] = ()
    bbox: BoundingBox2D = BoundingBox2D()
    id: str = ""


class Detection2DArray(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/Detection2DArray`."""

    header: Header = Header()
    detections: Sequence[Detection2D] = ()


class Detection3D(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/Detection3D`."""

    header: Header = Header()
    results: Sequence[ObjectHypothesisWithPose] = ()
    bbox: BoundingBox3D = BoundingBox3D()
    id: str = ""


class Detection3DArray(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/Detection3DArray`."""

    header: Header = Header()
    detections: Sequence[Detection3D] = ()


class VisionClass(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/VisionClass`."""

    class_id: uint16 = 0
    class_name: str = ""


class LabelInfo(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/LabelInfo`."""

    header: Header = Header()
    class_map: Sequence[VisionClass] = ()
    threshold: float32 = 0.0


class VisionInfo(Message, package="vision_msgs"):
    """The message `vision_msgs/msg/VisionInfo`."""

    header: Header = Header()
    method: str = ""
    database_location: str = ""
    database_version: int32 = 0


export_types(globals())
