"""Where the robot wants to go."""

from pydantic import Field

from busflow import Node, Parameters, client, publisher, timer
from busflow.msgs.geometry_msgs import Twist, Vector3
from busflow.msgs.std_srvs import SetBool


class PatrolParameters(Parameters):
    speed: float = Field(default=0.5, description="How fast to go, m/s.")
    leg_s: float = Field(default=4.0, gt=0, description="How long to go one way before turning back, s.")


class Patrol(Node):
    """Switches the motors on, then drives to and fro."""

    parameters: PatrolParameters
    commands = publisher(Twist, "cmd_vel")
    motors = client(SetBool, "motors")

    async def run(self) -> None:
        await self.motors.ready()
        answer = await self.motors.call(SetBool.Request(data=True))
        self.log.info("motors", state=answer.message)

    @timer(hz=10)
    def command(self) -> None:
        way = 1 if self.clock.seconds() // self.parameters.leg_s % 2 == 0 else -1
        self.commands.publish(Twist(linear=Vector3(x=way * self.parameters.speed)))
