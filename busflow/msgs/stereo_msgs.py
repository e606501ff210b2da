"""`stereo_msgs`: 1 message, from its definition files."""

# busflow interface generate stereo_msgs --to busflow/msgs
# wrote this from stereo_msgs 5.4.2 (Apache License 2.0). Change its files instead, and run that again:
#   msg/DisparityImage.msg  RIHS01_1ec1ff6b5bace919e4544a37f2d96ead9f81783701b7b7a4d97a09325ecf2711

from busflow.interfaces.message import Message, float32
from busflow.msgs.sensor_msgs import Image, RegionOfInterest
from busflow.msgs.std_msgs import Header

__all__ = ["DisparityImage"]


class DisparityImage(Message, package="stereo_msgs"):
    """The message `stereo_msgs/msg/DisparityImage`."""

    header: Header = Header()
    """Separate header for compatibility with current TimeSynchronizer.
    Likely to be removed in a later release, use image.header instead.
    """
    image: Image = Image()
    """Floating point disparity image. The disparities are pre-adjusted for any
    x-offset between the principal points of the two cameras (in the case
    that they are verged). That is: d = x_l - x_r - (cx_l - cx_r)
    """
    f: float32 = 0.0
    """Stereo geometry. For disparity d, the depth from the camera is Z = fT/d.

    Focal length, pixels
    """
    t: float32 = 0.0
    """Baseline, world units"""
    valid_window: RegionOfInterest = RegionOfInterest()
    """Subwindow of (potentially) valid disparity values."""
    min_disparity: float32 = 0.0
    """The range of disparities searched.
    In the disparity image, any disparity less than min_disparity is invalid.
    The disparity search range defines the horopter, or 3D volume that the
    stereo algorithm can "see". Points with Z outside of:
        Z_min = fT / max_disparity
        Z_max = fT / min_disparity
    could not be found.
    """
    max_disparity: float32 = 0.0
    delta_d: float32 = 0.0
    """Smallest allowed disparity increment. The smallest achievable depth range
    resolution is delta_Z = (Z^2/fT)*delta_d.
    """
