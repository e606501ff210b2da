"""A node of ROS 2 in a process of its own, on a raw session as `rmw_zenoh` opens it: `python -m … PORT LEASE_MS`.

It keeps one plan for late joiners, and answers a sum of 0; for any other sum it never has an answer. It goes on until
it is killed.
"""

import struct
import sys
import threading

from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.example_interfaces import AddTwoInts
from busflow.msgs.std_msgs import Int64
from tests.ros2.rmw_node import LATCHED, RmwNode
from tests.ros2.sessions import rmw_session

HEAD = b"\0\1\0\0"


def main(port: int, lease_ms: int) -> None:
    with rmw_session(port, lease_ms=lease_ms) as session:
        ros = RmwNode(session, "camera")

        def on_request(request: bytes, reply: object) -> None:
            a, b = struct.unpack_from("<qq", request, 4)
            if a + b == 0:
                reply(HEAD + struct.pack("<q", 0))
            else:
                kept.append(reply)

        kept: list[object] = []
        ros.late_server("/camera/add", TypeSupport(AddTwoInts), on_request)
        ros.publisher("/plan", TypeSupport(Int64), LATCHED)(HEAD + struct.pack("<q", 7))
        threading.Event().wait()


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
