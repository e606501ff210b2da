"""A thermometer on a serial line, whose driver blocks."""

import os
import select
import time
from typing import Protocol

from pydantic import Field

from busflow import Node, Parameters, ReadOnly, publisher, timer
from busflow.msgs.sensor_msgs import Temperature
from busflow.msgs.std_msgs import Header


class Device(Protocol):
    """What both devices can do; each call blocks."""

    def read(self) -> float: ...

    def close(self) -> None: ...


class SerialLine:
    """Asks by a line with `?` and reads one number. With pyserial this is `serial.Serial(path, timeout=0.2)`."""

    def __init__(self, path: str) -> None:
        self.file = os.open(path, os.O_RDWR | os.O_NOCTTY)

    def read(self) -> float:
        os.write(self.file, b"?\n")
        if not select.select([self.file], [], [], 0.2)[0]:
            raise TimeoutError("the thermometer did not answer within 0.2 s")
        return float(os.read(self.file, 64))

    def close(self) -> None:
        os.close(self.file)


class Simulated:
    """Takes a while, and gets warmer."""

    def __init__(self) -> None:
        self.celsius = 20.0

    def read(self) -> float:
        time.sleep(0.001)  # as long as the line would block
        self.celsius += 0.5
        return self.celsius

    def close(self) -> None:
        pass


class ThermometerParameters(Parameters):
    port: ReadOnly[str] = Field(default="simulated", description="The serial line, or `simulated`.")
    rate_hz: float = Field(default=2.0, gt=0, le=20, description="How often to ask, Hz.")


class Thermometer(Node):
    """Asks a blocking driver in a thread; the other nodes go on meanwhile."""

    parameters: ThermometerParameters
    temperature = publisher(Temperature, "temperature")
    device: Device | None = None

    async def start(self) -> None:
        port = self.parameters.port
        self.device = Simulated() if port == "simulated" else await self.run_sync(SerialLine, port)

    @timer(hz="rate_hz")
    async def ask(self) -> None:
        assert self.device is not None
        celsius = await self.run_sync(self.device.read)
        header = Header(stamp=self.clock.now(), frame_id="thermometer")
        self.temperature.publish(Temperature(header=header, temperature=celsius))

    async def stop(self) -> None:
        if self.device is not None:
            await self.run_sync(self.device.close)
