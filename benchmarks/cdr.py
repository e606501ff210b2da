"""What encoding and decoding CDR costs, beside rosbags: `python benchmarks/cdr.py`.

The four are timed in turns, round after round, so that a noisy machine is noisy to all; the best round counts. The
garbage collector runs. rosbags decodes into dataclasses of numpy arrays, busflow into frozen pydantic messages; the
last column is what reading by the description alone costs, into dictionaries.
"""

from __future__ import annotations

import os
import platform
import sys
import timeit
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import Message, type_name
from busflow.msgs.geometry_msgs import PoseStamped, TransformStamped, Vector3
from busflow.msgs.nav_msgs import Path
from busflow.msgs.sensor_msgs import Image, Imu, JointState, LaserScan, PointCloud2
from busflow.msgs.std_msgs import Float64MultiArray, Header, String
from busflow.msgs.tf2_msgs import TFMessage

QUICK = "--quick" in sys.argv
"""One short round: to see that everything works."""
ROUNDS = 1 if QUICK else 60
ROUND_S = 0.002
HEADER = Header(frame_id="base_link")

MESSAGES: Mapping[str, Message] = {
    "Vector3": Vector3(x=1.0, y=2.0, z=3.0),
    "String (14)": String(data="Hello World: 1"),
    "Imu": Imu(header=HEADER),
    "JointState (10)": JointState(
        header=HEADER,
        name=[f"joint_{number}" for number in range(10)],
        position=np.ones(10),
        velocity=np.ones(10),
        effort=np.ones(10),
    ),
    "LaserScan (720)": LaserScan(header=HEADER, ranges=np.ones(720, np.float32), intensities=np.ones(720, np.float32)),
    "TFMessage (10)": TFMessage(transforms=[TransformStamped(header=HEADER, child_frame_id="link")] * 10),
    "Path (50)": Path(header=HEADER, poses=[PoseStamped(header=HEADER)] * 50),
    "PointCloud2 1 MB": PointCloud2(header=HEADER, data=np.ones(1 << 20, np.uint8)),
    "Image 1 MB": Image(header=HEADER, data=np.ones(1 << 20, np.uint8)),
    "Float64s 1 MB": Float64MultiArray(data=np.ones(1 << 17)),
}


def measured(functions: list[Callable[[], object]]) -> list[float]:
    """The microseconds that a call of each takes, at best."""
    timers = [timeit.Timer(function, setup="import gc; gc.enable()") for function in functions]
    counts = [max(1, int(ROUND_S / (timer.timeit(20) / 20))) for timer in timers]
    best = [float("inf")] * len(timers)
    for _ in range(ROUNDS):
        for index, (timer, count) in enumerate(zip(timers, counts, strict=True)):
            best[index] = min(best[index], timer.timeit(count) / count)
    return [seconds * 1e6 for seconds in best]


def row(title: str, message: Message, store: Any) -> str:
    """The line of one type."""
    support, name = TypeSupport(type(message)), type_name(type(message))
    foreign = ForeignType(support.name, support.type_hash, support.description)
    data = support.encode(message)
    other = store.deserialize_cdr(data, name)
    assert bytes(store.serialize_cdr(other, name)) == data  # noqa: S101 - both do the same work, or nothing is compared
    assert support.decode(data) == message  # noqa: S101 - as above
    encode, decode = support.encode, support.decode
    ours, theirs, ours_back, theirs_back, plain = measured(
        [
            lambda: encode(message),
            lambda: store.serialize_cdr(other, name),
            lambda: decode(data),
            lambda: store.deserialize_cdr(data, name),
            lambda: foreign.decode(data),
        ]
    )
    both = (theirs + theirs_back) / (ours + ours_back)
    return (
        f"{title:18}{len(data):>9}{ours:>10.2f}{theirs:>10.2f}{theirs / ours:>7.1f}×"
        f"{ours_back:>10.2f}{theirs_back:>10.2f}{theirs_back / ours_back:>7.1f}×{both:>8.1f}×{plain:>10.2f}"
    )


def main() -> None:
    """Prints the table."""
    load = ", ".join(f"{each:.1f}" for each in os.getloadavg())
    versions = f"Python {platform.python_version()}, numpy {np.__version__}"
    print(f"{versions}, {os.cpu_count()} cores, load {load}; µs per message")
    print(f"{'':27}{'encode':>10}{'rosbags':>10}{'':8}{'decode':>10}{'rosbags':>10}{'':8}{'both':>9}{'plain':>10}")
    store = get_typestore(Stores.LATEST)
    for title, message in MESSAGES.items():
        print(row(title, message, store), flush=True)


if __name__ == "__main__":
    main()
