"""`stereo_msgs`: 1 message, from its definition files."""

# busflow interface generate stereo_msgs --to busflow/msgs
# wrote this from stereo_msgs 5.4.2 (Apache License 2.0). The comments of its files are left out. The files:
#   msg/DisparityImage.msg  RIHS01_1ec1ff6b5bace919e4544a37f2d96ead9f81783701b7b7a4d97a09325ecf2711

from busflow.interfaces.message import Message, float32
from busflow.msgs.sensor_msgs import Image, RegionOfInterest
from busflow.msgs.std_msgs import Header

__all__ = ["DisparityImage"]


class DisparityImage(Message, package="stereo_msgs"):
    """The message `stereo_msgs/msg/DisparityImage`."""

    header: Header = Header()
    image: Image = Image()
    f: float32 = 0.0
    t: float32 = 0.0
    valid_window: RegionOfInterest = RegionOfInterest()
    min_disparity: float32 = 0.0
    max_disparity: float32 = 0.0
    delta_d: float32 = 0.0
