"""Messages: what it costs to make one, to put it into bytes, and to make one of bytes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, make_dataclass
from typing import Any

import numpy as np

from benchmarks.question import Case, Contender, Effort, Question, Quoted, Sample
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import Message
from busflow.msgs.builtin_interfaces import Time
from busflow.msgs.geometry_msgs import Quaternion, Vector3
from busflow.msgs.sensor_msgs import Image, Imu, JointState, PointCloud2, PointField
from busflow.msgs.std_msgs import Header

NAMES = [f"joint_{number}" for number in range(10)]
NUMBERS = [number / 7 for number in range(10)]
ARRAY = np.array(NUMBERS)
NINE, NINE_ARRAY = [0.0] * 9, np.zeros(9)
PIXELS = bytes(1 << 20)
PIXEL_ARRAY = np.frombuffer(PIXELS, np.uint8)
AXES = ("x", "y", "z", "intensity")


@dataclass(frozen=True)
class Maker:
    """One way to have messages: how each is made, and how they become bytes and come back."""

    make: dict[str, Callable[[], Any]]
    encode: Callable[[str, Any], Callable[[], bytes]] | None = None
    decode: Callable[[str, bytes], Callable[[], Any]] | None = None


def nested(types: Any, arrays: Any, pixels: Any, given: dict[str, Any]) -> dict[str, Callable[[], Any]]:
    """How a program makes each of them anew: `types` has the classes, the rest what their fields are given.

    `given` has, by type, fields that have no default there.
    """

    def header() -> Any:
        return types.Header(stamp=types.Time(sec=1, nanosec=2), frame_id="imu_link")

    def vector() -> Any:
        return types.Vector3(x=0.1, y=0.2, z=9.8)

    def imu() -> Any:
        return types.Imu(
            header=header(),
            orientation=types.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0),
            angular_velocity=vector(),
            linear_acceleration=vector(),
            **given["Imu"],
        )

    def joints() -> Any:
        return types.JointState(header=header(), name=NAMES, position=arrays, velocity=arrays, effort=arrays)

    def image() -> Any:
        return types.Image(
            header=header(), height=512, width=2048, encoding="mono8", is_bigendian=0, step=2048, data=pixels
        )

    def cloud() -> Any:
        fields = [types.PointField(name=name, offset=4 * at, datatype=7, count=1) for at, name in enumerate(AXES)]
        sizes = {"height": 1, "width": 1 << 16, "point_step": 16, "row_step": 1 << 20}
        return types.PointCloud2(
            header=header(), fields=fields, is_bigendian=False, is_dense=True, data=pixels, **sizes
        )

    return {"Vector3": vector, "Imu": imu, "JointState": joints, "Image": image, "PointCloud2": cloud}


def busflow_messages() -> Maker:
    """Checked and frozen; CDR as ROS 2 has it."""

    class Types:
        pass

    for each in (Time, Header, Vector3, Quaternion, Imu, JointState, Image, PointField, PointCloud2):
        setattr(Types, each.__name__, each)
    supports: dict[str, TypeSupport] = {}

    def support(name: str) -> TypeSupport:
        kind: type[Message] = getattr(Types, name)
        return supports.setdefault(name, TypeSupport(kind))

    def encode(name: str, message: Any) -> Callable[[], bytes]:
        coder = support(name).encode
        return lambda: coder(message)

    def decode(name: str, data: bytes) -> Callable[[], Any]:
        coder = support(name).decode
        return lambda: coder(data)

    return Maker(nested(Types, NUMBERS, PIXELS, {"Imu": {}}), encode, decode)


FIELDS: dict[str, dict[str, str]] = {
    "Time": {"sec": "int", "nanosec": "int"},
    "Header": {"stamp": "Time", "frame_id": "str"},
    "Vector3": {"x": "float", "y": "float", "z": "float"},
    "Quaternion": {"x": "float", "y": "float", "z": "float", "w": "float"},
    "Imu": {
        "header": "Header",
        "orientation": "Quaternion",
        "angular_velocity": "Vector3",
        "linear_acceleration": "Vector3",
        "orientation_covariance": "numbers",
        "angular_velocity_covariance": "numbers",
        "linear_acceleration_covariance": "numbers",
    },
    "JointState": {
        "header": "Header", "name": "names", "position": "numbers", "velocity": "numbers", "effort": "numbers",
    },
    "Image": {
        "header": "Header", "height": "int", "width": "int", "encoding": "str", "is_bigendian": "int", "step": "int",
        "data": "bytes",
    },
    "PointField": {"name": "str", "offset": "int", "datatype": "int", "count": "int"},
    "PointCloud2": {
        "header": "Header", "height": "int", "width": "int", "fields": "points", "is_bigendian": "bool",
        "point_step": "int", "row_step": "int", "data": "bytes", "is_dense": "bool",
    },
}  # fmt: skip
COVARIANCES = {name: NINE for name in FIELDS["Imu"] if name.endswith("covariance")}


def classes(make: Callable[[str, list[tuple[str, Any]]], type]) -> Any:
    """The same classes in another way, each made of its fields."""
    plain: dict[str, Any] = {
        "int": int, "float": float, "str": str, "bool": bool, "bytes": bytes, "names": list[str],
        "numbers": list[float],
    }  # fmt: skip
    for name, fields in FIELDS.items():
        plain[name] = make(name, [(field, plain[kind]) for field, kind in fields.items()])
        if name == "PointField":
            plain["points"] = list[plain[name]]  # type: ignore[valid-type]  # it is a type once it is made
    return type("Types", (), {name: plain[name] for name in FIELDS})


def dataclasses() -> Maker:
    """With slots and frozen, unchecked; they know nothing of bytes."""
    types = classes(lambda name, fields: make_dataclass(name, fields, frozen=True, slots=True, kw_only=True))
    return Maker(nested(types, NUMBERS, PIXELS, {"Imu": COVARIANCES}))


def msgspec_structs() -> Maker:
    """Frozen structs, checked when decoded and not when made; MessagePack."""
    import msgspec

    types = classes(lambda name, fields: msgspec.defstruct(name, fields, frozen=True, kw_only=True))
    encoder = msgspec.msgpack.Encoder()

    def encode(_name: str, message: Any) -> Callable[[], bytes]:
        return lambda: encoder.encode(message)

    def decode(name: str, data: bytes) -> Callable[[], Any]:
        decoder = msgspec.msgpack.Decoder(getattr(types, name))
        return lambda: decoder.decode(data)

    return Maker(nested(types, NUMBERS, PIXELS, {"Imu": COVARIANCES}), encode, decode)


def rosbags_types() -> Maker:
    """Dataclasses of numpy arrays, unchecked; CDR."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.LATEST)

    class Types:
        pass

    for name in FIELDS:
        full = next(full for full in store.types if full.endswith(f"/{name}"))
        setattr(Types, name, store.types[full])

    def encode(name: str, message: Any) -> Callable[[], bytes]:
        full = getattr(Types, name).__msgtype__
        return lambda: store.serialize_cdr(message, full)

    def decode(name: str, data: bytes) -> Callable[[], Any]:
        full = getattr(Types, name).__msgtype__
        return lambda: store.deserialize_cdr(data, full)

    given = {"Imu": dict.fromkeys(COVARIANCES, NINE_ARRAY)}
    return Maker(nested(Types, ARRAY, PIXEL_ARRAY, given), encode, decode)


def measure(contender: Contender, case: str, effort: Effort) -> Sample:
    """CPU time of one."""
    name, _, what = case.partition(", ")
    maker: Maker = contender.way()
    work = maker.make[name]
    if what != "construct":
        assert maker.encode is not None  # noqa: S101  # else it takes no part
        assert maker.decode is not None  # noqa: S101  # as above
        message = work()
        data = bytes(maker.encode(name, message)())
        work = maker.encode(name, message) if what == "encode" else maker.decode(name, data)
    return {"s": _per_call_s(work, effort.sample_s)}


def _per_call_s(work: Callable[[], object], for_s: float) -> float:
    began_ns = time.thread_time_ns()
    for _ in range(3):
        work()
    count = max(3, int(for_s * 1e9 / max(1, (time.thread_time_ns() - began_ns) / 3)))
    began_ns = time.thread_time_ns()
    for _ in range(count):
        work()
    return (time.thread_time_ns() - began_ns) / 1e9 / count


TYPES = ("Vector3", "Imu", "JointState", "Image", "PointCloud2")
CASES = [
    Case(f"{name}, {what}", title, name)
    for what, title in (
        ("construct", "To make one, with all that is nested in it"),
        ("encode", "To put it into bytes"),
        ("decode", "To make one of bytes"),
    )
    for name in TYPES
]
CONSTRUCTING = frozenset(case.name for case in CASES if case.name.endswith("construct"))

QUESTION = Question(
    name="messages",
    title="Messages",
    explanation=(
        "CPU time. JointState has ten joints, given as lists (rosbags: arrays); Image and PointCloud2 hold 1 MB. "
        "busflow checks types and ranges when a message is made, whichever way; msgspec checks types when it decodes; "
        "the others check nothing. busflow and rosbags write CDR, msgspec MessagePack."
    ),
    cases=CASES,
    contenders=[
        Contender("busflow", busflow_messages),
        Contender("dataclasses", dataclasses, cases=CONSTRUCTING, note="frozen, slots"),
        Contender("msgspec", msgspec_structs, needs=("msgspec",)),
        Contender("rosbags", rosbags_types, needs=("rosbags",)),
    ],
    measure=measure,
    quoted=(Quoted("rclpy", {("Imu, construct", "s"): 7.4e-6, ("JointState, construct", "s"): 4.3e-6}),),
    quoted_from="rclpy's messages, made and filled, on Debian's CPython 3.11.2: see above.",
)
