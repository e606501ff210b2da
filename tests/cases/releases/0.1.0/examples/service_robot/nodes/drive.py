"""The wheels: follow a velocity, and stop when none comes."""

from pydantic import Field, model_validator

from busflow import Node, Parameters, publisher, service, subscription, timer
from busflow.msgs.geometry_msgs import Twist, Vector3
from busflow.msgs.std_srvs import SetBool


class DriveParameters(Parameters):
    max_speed: float = Field(default=0.8, gt=0, le=2, description="The highest speed, m/s.")
    max_acceleration: float = Field(default=0.5, gt=0, description="The highest acceleration, m/s².")
    timeout_s: float = Field(default=0.5, gt=0, description="How long a command holds, s.")

    @model_validator(mode="after")
    def it_can_stop(self) -> "DriveParameters":
        if self.max_speed > 4 * self.max_acceleration:
            raise ValueError("max_speed must be at most 4 * max_acceleration: it has to stop within four seconds")
        return self


class Drive(Node):
    """Ramps the speed towards what is commanded; off, it stands."""

    parameters: DriveParameters
    velocity = publisher(Twist, "velocity")

    async def start(self) -> None:
        self.is_on, self.speed, self.target, self.commanded_s = False, 0.0, 0.0, 0.0

    @service(SetBool, "motors")
    def switch(self, request: SetBool.Request) -> SetBool.Response:
        self.is_on, self.target = request.data, 0.0
        return SetBool.Response(success=True, message="on" if request.data else "off")

    @subscription("cmd_vel")
    def on_command(self, command: Twist) -> None:
        limit = self.parameters.max_speed
        self.target, self.commanded_s = min(limit, max(-limit, command.linear.x)), self.clock.seconds()

    @timer(hz=20)
    def step(self) -> None:
        is_heard = self.clock.seconds() - self.commanded_s <= self.parameters.timeout_s
        target, most = (self.target if self.is_on and is_heard else 0.0), self.parameters.max_acceleration / 20
        self.speed += min(most, max(-most, target - self.speed))
        self.velocity.publish(Twist(linear=Vector3(x=self.speed)))
