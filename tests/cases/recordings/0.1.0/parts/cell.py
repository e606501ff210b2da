"""The nodes of a graph whose recording later versions must read and replay."""

from collections.abc import Sequence

from pydantic import Field

from busflow import Message, Node, Parameters, publisher, service, subscription, timer
from busflow.interfaces.message import Float32Array, zeros
from busflow.msgs.geometry_msgs import Vector3
from busflow.msgs.sensor_msgs import Imu
from busflow.msgs.std_msgs import Float64, Header
from busflow.msgs.std_srvs import SetBool


class Reading(Message, package="cell_msgs"):
    """A message of the project's own: nested, bounded, with a list of texts."""

    header: Header = Header()
    cells: Float32Array = zeros(0)
    labels: Sequence[str] = ()
    is_good: bool = True


class SourceParameters(Parameters):
    """Parameters of the source."""

    rate_hz: float = Field(default=20.0, gt=0, description="How often to publish.")


class Source(Node):
    """Publishes readings and accelerations."""

    parameters: SourceParameters
    readings = publisher(Reading, "reading")
    imu = publisher(Imu, "imu/data")

    async def start(self) -> None:
        self._count = 0

    @timer(hz="rate_hz")
    def tick(self) -> None:
        self._count += 1
        header = Header(stamp=self.clock.now().to_msg(), frame_id="cell")
        self.readings.publish(Reading(header=header, cells=[self._count, self._count / 2], labels=["a", "é"]))
        self.imu.publish(Imu(header=header, linear_acceleration=Vector3(z=float(self.rng.normal(9.81, 0.1)))))


class Total(Node):
    """Adds up what it receives, until it is switched off."""

    total = publisher(Float64, "total")

    async def start(self) -> None:
        self._sum, self._is_on = 0.0, True

    @subscription("reading")
    def on_reading(self, reading: Reading) -> None:
        self._sum += float(sum(reading.cells)) if self._is_on else 0.0
        self.total.publish(Float64(data=self._sum))

    @subscription("imu/data")
    def on_imu(self, imu: Imu) -> None:
        self._sum += imu.linear_acceleration.z

    @service(SetBool, "switch")
    def switch(self, request: SetBool.Request) -> SetBool.Response:
        self._is_on = request.data
        return SetBool.Response(success=True, message="switched")
