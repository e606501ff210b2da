"""A node of ROS 2 in a process of its own, written with zenoh-ros2-sdk: what it does comes line by line on its input.

Arguments: the port of the router. Each line is a JSON list, and so is each line of its output.
"""

import json
import sys
from typing import Any

import numpy as np
from zenoh_ros2_sdk import ROS2Publisher, ROS2ServiceClient, ROS2ServiceServer, ROS2Subscriber

STRING, BLOB = "std_msgs/msg/String", "lab/msg/Blob"
DEFINITIONS = {STRING: "string data", BLOB: "uint8[] data"}
ADD = "example_interfaces/srv/AddTwoInts"
ADD_PARTS = {"request_definition": "int64 a\nint64 b", "response_definition": "int64 sum"}


def say(*words: Any) -> None:
    sys.stdout.write(f"{json.dumps(words)}\n")
    sys.stdout.flush()


def main(port: int) -> None:
    """Do what the input says until it ends."""
    common = {"domain_id": 7, "router_port": port, "namespace": "/sdk"}

    def subscribed(topic: str, type_: str) -> ROS2Subscriber:
        def on_message(message: Any) -> None:
            data = message.data
            say("received", topic, data if isinstance(data, str) else [len(data), int(data[-1])])

        return ROS2Subscriber(
            topic, type_, on_message, msg_definition=DEFINITIONS[type_], node_name="listener", **common
        )

    def published(topic: str, type_: str) -> ROS2Publisher:
        return ROS2Publisher(topic, type_, msg_definition=DEFINITIONS[type_], node_name="talker", **common)

    kept = [subscribed("/chatter", STRING), subscribed("/picture", BLOB)]
    ways = {"/said": published("/said", STRING), "/seen": published("/seen", BLOB)}
    response = None

    def add(request: Any) -> Any:
        return response(sum=request.a + request.b)

    server = ROS2ServiceServer("/sdk/add", ADD, callback=add, node_name="adder", **ADD_PARTS, **common)
    response = server.response_msg_class
    client = ROS2ServiceClient("/robot/add", ADD, node_name="asker", timeout=1.0, **ADD_PARTS, **common)
    say("ready", server.type_hash)
    for line in sys.stdin:
        word, *rest = json.loads(line)
        if word == "publish":
            ways[rest[0]].publish(data=rest[1])
        elif word == "publish_bytes":
            data = np.zeros(rest[1], np.uint8)
            data[-1] = 7
            ways[rest[0]].publish(data=data)
        elif word == "call":
            answer = client.call(a=rest[0], b=rest[1])
            say("answer", None if answer is None else int(answer.sum))
    del kept


if __name__ == "__main__":
    main(int(sys.argv[1]))
