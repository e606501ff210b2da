"""The simulated force sensor in a robot's foot."""

from math import sin, tau

from pydantic import Field

from busflow import SENSOR_DATA, Node, Parameters, ReadOnly, publisher, timer
from busflow.msgs.geometry_msgs import Vector3, Wrench, WrenchStamped
from busflow.msgs.std_msgs import Header


class FootSensorParameters(Parameters):
    rate_hz: float = Field(default=100.0, ge=0, le=1000, description="How often the force is published; 0 is off.")
    weight: float = Field(default=600.0, gt=0, le=5000, description="The robot's weight, N.")
    cadence_hz: float = Field(default=0.5, ge=0, le=5, description="How often the weight is on this foot.")
    phase: float = Field(default=0.0, description="Where in its stride it begins: π for the other foot, rad.")
    noise: float = Field(default=2.0, ge=0, le=100, description="± this on each axis of the force, N.")
    frame_id: ReadOnly[str] = Field(default="foot_link", description="The foot's frame.")


class FootSensor(Node):
    """Publishes the force under a foot of a robot that walks."""

    parameters: FootSensorParameters

    wrench = publisher(WrenchStamped, "foot/wrench", qos=SENSOR_DATA)

    @timer(hz="rate_hz")
    def publish_wrench(self) -> None:
        share = 0.5 + 0.5 * sin(tau * self.parameters.cadence_hz * self.clock.seconds() + self.parameters.phase)
        x, y, z = (self.parameters.noise * (2.0 * self.rng.random(3) - 1.0)).tolist()
        force = Vector3(x=x, y=y, z=max(0.0, share * self.parameters.weight + z))  # a foot does not pull at the ground
        header = Header(stamp=self.clock.now(), frame_id=self.parameters.frame_id)
        self.wrench.publish(WrenchStamped(header=header, wrench=Wrench(force=force)))
