"""Cameras: pictures and what is needed to measure in them.

A picture's frame is the optical one: x to the right of the picture, y down, z out of the camera.
"""

from typing import Annotated

from busflow.interfaces.message import Float64Array, Length, Message, ServiceType, UInt8Array, uint8, uint32, zeros
from busflow.msgs.std_msgs import Header


class Image(Message, package="sensor_msgs"):
    """A picture, not compressed; its first pixel is the top left one."""

    header: Header = Header()
    """When it was taken, in the camera's optical frame."""
    height: uint32 = 0
    """Rows."""
    width: uint32 = 0
    """Columns."""
    encoding: str = ""
    """What a pixel is: `rgb8`, `bgr8`, `rgba8`, `mono8`, `mono16`, `bayer_rggb8`, `32FC1`, …"""
    is_bigendian: uint8 = 0
    """1 where the high byte of a wider value comes first."""
    step: uint32 = 0
    """Bytes of a row."""
    data: UInt8Array = zeros()
    """`step * height` bytes, row by row. An array of another shape is flattened."""


class CompressedImage(Message, package="sensor_msgs"):
    """A compressed picture."""

    header: Header = Header()
    """When it was taken, in the camera's optical frame."""
    format: str = ""
    """`jpeg`, `png`; image_transport writes more: `rgb8; jpeg compressed bgr8`."""
    data: UInt8Array = zeros()
    """The compressed file."""


class RegionOfInterest(Message, package="sensor_msgs"):
    """A part of a camera's full picture, px. A height and width of 0 mean all of it."""

    x_offset: uint32 = 0
    """The first column."""
    y_offset: uint32 = 0
    """The first row."""
    height: uint32 = 0
    width: uint32 = 0
    do_rectify: bool = False
    """Whether the part differs in the rectified picture; true as a rule where only a part is taken."""


class CameraInfo(Message, package="sensor_msgs"):
    """How a camera maps the world to pixels. Of a camera that was never calibrated `k[0]` is 0."""

    header: Header = Header()
    """The header of the picture it belongs to."""
    height: uint32 = 0
    """Rows of the picture that was calibrated with, as a rule the full one."""
    width: uint32 = 0
    """Columns of the picture that was calibrated with."""
    distortion_model: str = ""
    """What `d` means: `plumb_bob` (the usual lens), `rational_polynomial`, `equidistant` (fisheye)."""
    d: Float64Array = zeros()
    """The distortion; for `plumb_bob` k1, k2, t1, t2, k3."""
    k: Annotated[Float64Array, Length(9)] = zeros(9)
    """The raw picture's camera matrix, 3 × 3 by rows: fx 0 cx, 0 fy cy, 0 0 1, px."""
    r: Annotated[Float64Array, Length(9)] = zeros(9)
    """The rotation that makes the lines of a stereo pair parallel, 3 × 3 by rows."""
    p: Annotated[Float64Array, Length(12)] = zeros(12)
    """The rectified picture's projection matrix, 3 × 4 by rows: fx 0 cx Tx, 0 fy cy Ty, 0 0 1 0.

    Tx is -fx times the baseline for the second camera of a stereo pair, otherwise 0."""
    binning_x: uint32 = 0
    """How many columns became one; 0 counts as 1."""
    binning_y: uint32 = 0
    """How many rows became one; 0 counts as 1."""
    roi: RegionOfInterest = RegionOfInterest()
    """The part that was taken, in pixels before binning."""


class SetCameraInfo(ServiceType, package="sensor_msgs"):
    """Asks a camera to keep a calibration."""

    class Request(Message):
        """The calibration, for the picture size that the camera gives now."""

        camera_info: CameraInfo = CameraInfo()

    class Response(Message):
        """Whether the camera keeps it."""

        success: bool = False
        status_message: str = ""
        """Why not, or other details."""
