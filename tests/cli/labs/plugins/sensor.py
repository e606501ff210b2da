from pydantic import BaseModel, Field

from busflow import Node, Parameters, ReadOnly


class Noise(BaseModel, frozen=True, extra="forbid"):
    imu: float = Field(default=0.1, ge=0, le=10)


class SensorParameters(Parameters):
    rate_hz: float = Field(default=10.0, gt=0)
    frame_id: ReadOnly[str] = "imu_link"
    noise: Noise = Noise()


class Sensor(Node):
    parameters: SensorParameters

    async def start(self) -> None:
        self.log.info("works")
