"""A node of ROS 2 whose session also listens at a Unix socket, and says so by gossip: `python -m … PORT PATH ZID`.

It prints the key of each message and of each answer about the run that reaches it, and goes on until it is killed.
"""

import sys
import time

from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import String
from tests.ros2.rmw_node import RmwNode
from tests.ros2.sessions import AGAIN_S, RMW_ZENOH, opened

STRING = TypeSupport(String)


def show(key: object) -> None:
    """Print a line in one write: the threads of Zenoh do so at any time."""
    sys.stdout.write(f"{key}\n")
    sys.stdout.flush()


def main(port: str, path: str, zid: str, *also: str) -> None:
    own = {"id": zid, "listen/endpoints": [f"unixsock-stream/{path}", *also]}
    with opened(RMW_ZENOH | own | {"connect/endpoints": [f"tcp/localhost:{port}"]}) as session:
        ros = RmwNode(session, "ros")
        for topic in ("/secret", "/chatter"):
            ros.subscription(topic, STRING, lambda sample: show(sample.key_expr))
        ways = [ros.publisher(topic, STRING) for topic in ("/order", "/said")]
        while True:
            time.sleep(AGAIN_S)
            for way in ways:
                way(STRING.encode(String(data="x")))
            session.get("@busflow/1/*/run", lambda answer: answer.ok and show(answer.ok.key_expr))


if __name__ == "__main__":
    main(*sys.argv[1:])
