"""The simulated joints of a robot, or of a limb of it, described one by one in a launch file."""

from math import cos, sin, tau

from pydantic import Field, model_validator

from busflow import Node, Parameters, ReadOnly, publisher, timer
from busflow.msgs.sensor_msgs import JointState
from busflow.msgs.std_msgs import Header


class Joint(Parameters):
    """One joint: it swings as centre + amplitude · sin(2π · cadence · t + phase)."""

    name: str = Field(min_length=1, description="Its name, without the prefix.")
    group: str = Field(default="", description="What it is part of: leg, arm, head.")
    centre: float = Field(default=0.0, description="What it swings about, rad.")
    amplitude: float = Field(ge=0, description="How far it swings to either side, rad.")
    phase: float = Field(default=0.0, description="Where in its swing it begins, rad.")
    lower: float = Field(description="It turns no further down, rad.")
    upper: float = Field(description="It turns no further up, rad.")

    @model_validator(mode="after")
    def swings_within_its_limits(self) -> "Joint":
        lowest, highest = self.centre - self.amplitude, self.centre + self.amplitude
        if not self.lower <= lowest <= highest <= self.upper:
            raise ValueError(
                f"{self.name} swings from {lowest:g} to {highest:g}, beyond its limits {self.lower:g} to {self.upper:g}"
            )
        return self


class JointSimulatorParameters(Parameters):
    rate_hz: float = Field(default=100.0, ge=0, le=1000, description="How often the joints are published; 0 is off.")
    cadence_hz: float = Field(default=0.5, ge=0, le=5, description="How often they swing.")
    phase: float = Field(default=0.0, description="Added to the phase of each: π for the other leg, rad.")
    noise: float = Field(default=0.0, ge=0, le=0.1, description="± this on each position, within its limits, rad.")
    prefix: ReadOnly[str] = Field(default="", description="Put before each joint's name: left_.")
    joints: ReadOnly[list[Joint]] = Field(min_length=1, description="The joints.")

    @model_validator(mode="after")
    def each_joint_is_there_once(self) -> "JointSimulatorParameters":
        names = [joint.name for joint in self.joints]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"there are several joints called {', '.join(twice)}")
        return self


class JointSimulator(Node):
    """Publishes the joints that its parameters describe, as they swing."""

    parameters: JointSimulatorParameters

    joint_states = publisher(JointState, "joint_states")

    async def start(self) -> None:
        self.names = tuple(self.parameters.prefix + joint.name for joint in self.parameters.joints)

    @timer(hz="rate_hz")
    def publish_joints(self) -> None:
        parameters = self.parameters
        speed = tau * parameters.cadence_hz
        angle = (
            speed * self.clock.seconds() + parameters.phase
        )  # the run's time: a restarted simulator is in phase with the others
        noise = parameters.noise * (2.0 * self.rng.random(len(self.names)) - 1.0)
        positions = [
            min(joint.upper, max(joint.lower, joint.centre + joint.amplitude * sin(angle + joint.phase) + off))
            for joint, off in zip(parameters.joints, noise.tolist(), strict=True)
        ]
        velocities = [speed * joint.amplitude * cos(angle + joint.phase) for joint in parameters.joints]
        header = Header(stamp=self.clock.now())
        self.joint_states.publish(JointState(header=header, name=self.names, position=positions, velocity=velocities))
