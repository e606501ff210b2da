"""Joint states of the whole robot in one message, merged from the messages of its parts."""

from functools import partial

import numpy as np
from pydantic import Field, model_validator

from busflow import Node, Parameters, ReadOnly, publisher, timer
from busflow.msgs.sensor_msgs import JointState
from busflow.msgs.std_msgs import Header


class JointStatePublisherParameters(Parameters):
    rate_hz: float = Field(default=100.0, ge=0, le=1000, description="How often all joints are published; 0 is off.")
    timeout_s: float = Field(default=0.5, gt=0, description="A part silent for so long is left out, s.")
    source_list: ReadOnly[list[str]] = Field(min_length=1, description="The topics with the joints of the parts.")

    @model_validator(mode="after")
    def each_source_is_there_once(self) -> "JointStatePublisherParameters":
        if len(set(self.source_list)) < len(self.source_list):
            raise ValueError(f"a source stands twice: {', '.join(self.source_list)}")
        return self


class JointStatePublisher(Node):
    """Merges the joints of several topics; a part that falls silent is left out until it publishes again."""

    parameters: JointStatePublisherParameters

    joint_states = publisher(JointState, "joint_states")

    def declare(self) -> None:
        for source in self.parameters.source_list:
            self.create_subscription(JointState, source, partial(self.on_joints, source))

    async def start(self) -> None:
        self.parts: dict[str, tuple[float, JointState]] = {}  # the last joints of each part, and when they came
        self.left_out: list[str] = []

    def on_joints(self, source: str, joints: JointState) -> None:
        self.parts[source] = self.clock.seconds(), joints

    @timer(hz="rate_hz")
    def publish_joints(self) -> None:
        oldest_s = self.clock.seconds() - self.parameters.timeout_s
        silent = [source for source, (received_s, _) in self.parts.items() if received_s < oldest_s]
        if silent != self.left_out:
            self.left_out = silent
            self.log.info("parts are left out" if silent else "all parts are back", silent=silent)
        parts = [joints for source, (_, joints) in self.parts.items() if source not in silent]
        if parts:
            self.joint_states.publish(
                JointState(
                    header=Header(stamp=self.clock.now()),
                    name=[name for joints in parts for name in joints.name],
                    position=np.concatenate([joints.position for joints in parts]),
                    velocity=np.concatenate([joints.velocity for joints in parts]),
                )
            )
