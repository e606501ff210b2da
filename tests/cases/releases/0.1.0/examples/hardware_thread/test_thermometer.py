"""The alarm warns once; a real line is asked and read; one that is silent fails the node, which is started anew."""

import os
import pty
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from busflow.msgs.sensor_msgs import Temperature
from busflow.testing import harness, virtual_time

FILE = Path(__file__).parent / "thermometer.yaml"


@virtual_time
async def test_alarm_warns_once():
    async with harness(FILE) as lab:
        await lab.advance(10)
        assert [round(each.temperature, 1) for each in lab.received("temperature", Temperature)][:3] == [
            20.5,
            21.0,
            21.5,
        ]
        assert [(record.event, record.values["celsius"]) for record in lab.log] == [("too hot", 25.5)]


@pytest.fixture
def line() -> Iterator[str]:
    """A pseudo-terminal at whose other end a thermometer answers 21.5."""
    end, device = pty.openpty()

    def answer() -> None:
        while os.read(end, 64).strip() == b"?":
            os.write(end, b"21.5\n")

    thread = threading.Thread(target=answer)
    thread.start()
    os.set_blocking(device, True)
    yield os.ttyname(device)
    os.write(device, b"end\n")
    thread.join(10)
    os.close(device)
    os.close(end)


@virtual_time
async def test_a_serial_line_is_asked(line: str):
    async with harness(FILE, args={"port": line}) as lab:
        await lab.advance(1)
        assert {each.temperature for each in lab.received("temperature", Temperature)} == {21.5}
