"""`example_interfaces`: 29 messages, 3 services, 1 action, from its definition files."""

# busflow interface generate example_interfaces --to busflow/msgs
# wrote this from example_interfaces 0.13.0 (Apache License 2.0). The comments of its files are left out. The files:
#   msg/Bool.msg                 RIHS01_4765c142500f8fd4e1a32fb3edd7b7d9d822a16ec270445f5120e772c5f9aed5
#   msg/Byte.msg                 RIHS01_f014e0424be54b8ba7c35490aea4198be92df1de4e88f4e19a2fbbce2e020bb9
#   msg/ByteMultiArray.msg       RIHS01_257fc3429b3c4dd0aea678c234f543665d1144b396f82c7ee60fed151e1dace3
#   msg/Char.msg                 RIHS01_320dcd57e1183fb08463cc3ab50bf7e5ce0ecee39f64d15a9e9eeca3384c91a5
#   msg/Empty.msg                RIHS01_73c22a7341eeccf8ef504a991e60d4078223f0931a5d5d212800e7c978903c58
#   msg/Float32.msg              RIHS01_6a112d9235f8e8088d7a2bc77cb955341ac0d5c9870bdc592651a4186bb246f3
#   msg/Float32MultiArray.msg    RIHS01_8705278e8d206a9711133794ce6466281e9698138331c4b3d91e6cc9e9dfee26
#   msg/Float64.msg              RIHS01_74c137b7930c26339425a95fcfab441199bc41e0e572d3a0c9e95badd72b50da
#   msg/Float64MultiArray.msg    RIHS01_62a0985e7920b7bc489d1392f08c06ba0080fff5b8eaa09b27dcac122f50ad95
#   msg/Int16.msg                RIHS01_332d94306732e4e35da38e5ae744ff35bbdaeca300908dc43488d3a844687cd6
#   msg/Int16MultiArray.msg      RIHS01_d663e739410479619bfb7b9b94b0a764998acffadb8b7f5b200affa87b7ffdd2
#   msg/Int32.msg                RIHS01_5cd04cd7f3adb9d6c6064c316047b24c76622eb89144f300b536d657fd55e652
#   msg/Int32MultiArray.msg      RIHS01_b347aff8e38e2ce3f7f4023db7922d2d4abb9d593b03c40b1427640c26595bfa
#   msg/Int64.msg                RIHS01_1b3b9a6502f560d079520c73c685a9550e5a1838d2cefd537fe0aba75a3639a0
#   msg/Int64MultiArray.msg      RIHS01_ebce42c0d2b81bc5309deb0b2d83e30236aeb4899aea3cc7ddd18787af39c94a
#   msg/Int8.msg                 RIHS01_2e9ef643d84ff37840fe787d1269aa06268960e294f4a0f5eb1e9d4eb21cbb57
#   msg/Int8MultiArray.msg       RIHS01_6d26932aefc0e5c0c473613376338609bac9925e3527dc4e8fab6b6783b6d680
#   msg/MultiArrayDimension.msg  RIHS01_a785cb9839e177e3eb760260139a919fec87821edc3314c592f2725abbf0bfcd
#   msg/MultiArrayLayout.msg     RIHS01_ba42ea30074e5826a1e91f70f3660dda2996937169487f877fc20a8a402e2c27
#   msg/String.msg               RIHS01_5509d866a579951f2fc6c19577c32605ba16f308cae7b498341d79536d4eb06b
#   msg/UInt16.msg               RIHS01_e123d0a691fa0ce58b682f1a4eee55137dd3f20c81665f0c556f53596c7fb377
#   msg/UInt16MultiArray.msg     RIHS01_507f6456c1965ef6eab8a9cfa8860bd484e1b7039b4c4ea2c75c648182fceade
#   msg/UInt32.msg               RIHS01_e86cccba586f30c16498f3ccd3550a764b255239a6142be3a4d7a2fa9a43515c
#   msg/UInt32MultiArray.msg     RIHS01_0683176c523a116c76141c6d4abd150dbff492b72185f1260ce38a18a35aafcf
#   msg/UInt64.msg               RIHS01_6a3f8548c5818b7add62dd6cbbd840fd1ab17fbf9d73cad6690557b7326d8908
#   msg/UInt64MultiArray.msg     RIHS01_c05a348bd887aac76a947c901f67f93bf9a7fa14b28dce02eb495dadeb8842e4
#   msg/UInt8.msg                RIHS01_9255b6d0dd98f5b573afbff223131279b788ac45cf051fb462c12dd9a30f4061
#   msg/UInt8MultiArray.msg      RIHS01_7a49ef5ed9b7182488303b4027d54719ba7266e776bd446dac30e79b56fb0a71
#   msg/WString.msg              RIHS01_32033e06d9dfe5468c5d6e1dc8b7a23c8910bad071cfd4e151a951d580e68dd8
#   srv/AddTwoInts.srv           RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a
#   srv/SetBool.srv              RIHS01_a69782e5631b12e15c8e218410de1685bbf13e382718295adad14037a24afbe8
#   srv/Trigger.srv              RIHS01_cfeeee47f8105dd7685e4c92d46d4074669cb1c477402be1dea37486542a69e0
#   action/Fibonacci.action      RIHS01_9508051da1ea4658de144b09bd0690ff3de52104683d847aed764d2915906f51

from collections.abc import Sequence

from busflow.interfaces.action import ActionType
from busflow.interfaces.message import (
    ByteArray,
    Float32Array,
    Float64Array,
    Int8Array,
    Int16Array,
    Int32Array,
    Int64Array,
    Message,
    ServiceType,
    UInt8Array,
    UInt16Array,
    UInt32Array,
    UInt64Array,
    byte,
    char,
    float32,
    float64,
    int8,
    int16,
    int32,
    int64,
    uint8,
    uint16,
    uint32,
    uint64,
    wstring,
    zeros,
)
from busflow.msgs import export_types


class Bool(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Bool`."""

    data: bool = False


class Byte(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Byte`."""

    data: byte = 0


class MultiArrayDimension(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/MultiArrayDimension`."""

    label: str = ""
    size: uint32 = 0
    stride: uint32 = 0


class MultiArrayLayout(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/MultiArrayLayout`."""

    dim: Sequence[MultiArrayDimension] = ()
    data_offset: uint32 = 0


class ByteMultiArray(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/ByteMultiArray`."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: ByteArray = zeros()


class Char(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Char`."""

    data: char = 0


class Empty(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Empty`."""


class Float32(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Float32`."""

    data: float32 = 0.0


class Float32MultiArray(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Float32MultiArray`."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Float32Array = zeros()


class Float64(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Float64`."""

    data: float64 = 0.0


class Float64MultiArray(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Float64MultiArray`."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Float64Array = zeros()


class Int16(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Int16`."""

    data: int16 = 0


class Int16MultiArray(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Int16MultiArray`."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Int16Array = zeros()


class Int32(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Int32`."""

    data: int32 = 0


class Int32MultiArray(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Int32MultiArray`."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Int32Array = zeros()


class Int64(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Int64`."""

    data: int64 = 0


class Int64MultiArray(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Int64MultiArray`."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Int64Array = zeros()


class Int8(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Int8`."""

    data: int8 = 0


class Int8MultiArray(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/Int8MultiArray`."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Int8Array = zeros()


class String(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/String`."""

    data: str = ""


class UInt16(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/UInt16`."""

    data: uint16 = 0


class UInt16MultiArray(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/UInt16MultiArray`."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: UInt16Array = zeros()


class UInt32(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/UInt32`."""

    data: uint32 = 0


class UInt32MultiArray(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/UInt32MultiArray`."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: UInt32Array = zeros()


class UInt64(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/UInt64`."""

    data: uint64 = 0


class UInt64MultiArray(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/UInt64MultiArray`."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: UInt64Array = zeros()


class UInt8(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/UInt8`."""

    data: uint8 = 0


class UInt8MultiArray(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/UInt8MultiArray`."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: UInt8Array = zeros()


class WString(Message, package="example_interfaces"):
    """The message `example_interfaces/msg/WString`."""

    data: wstring = ""


class AddTwoInts(ServiceType, package="example_interfaces"):
    """The service `example_interfaces/srv/AddTwoInts`."""

    class Request(Message):
        """The request."""

        a: int64 = 0
        b: int64 = 0

    class Response(Message):
        """The response."""

        sum: int64 = 0


class SetBool(ServiceType, package="example_interfaces"):
    """The service `example_interfaces/srv/SetBool`."""

    class Request(Message):
        """The request."""

        data: bool = False

    class Response(Message):
        """The response."""

        success: bool = False
        message: str = ""


class Trigger(ServiceType, package="example_interfaces"):
    """The service `example_interfaces/srv/Trigger`."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        success: bool = False
        message: str = ""


class Fibonacci(ActionType, package="example_interfaces"):
    """The action `example_interfaces/action/Fibonacci`."""

    class Goal(Message):
        """The goal."""

        order: int32 = 0

    class Result(Message):
        """The result."""

        sequence: Int32Array = zeros()

    class Feedback(Message):
        """The feedback."""

        sequence: Int32Array = zeros()


export_types(globals())
