"""The service answers with what the graph publishes, and asks its services; over a real connection."""

import asyncio
import importlib.util
import json
from pathlib import Path

from busflow.msgs.sensor_msgs import BatteryState

_spec = importlib.util.spec_from_file_location("busflow_example_server", Path(__file__).parent / "server.py")
server = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(server)


async def asked(port: int, line: str) -> tuple[int, dict]:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(f"{line} HTTP/1.1\r\nHost: robot\r\n\r\n".encode())
    head, _, body = (await reader.read()).partition(b"\r\n\r\n")
    writer.close()
    return int(head.split()[1]), json.loads(body)


def test_service_answers_from_the_graph():
    async def check():
        async with asyncio.timeout(30), server.served() as (graph, port):
            states = graph.subscribe(BatteryState, "battery")
            for _ in range(2):
                await anext(states)
            status, answer = await asked(port, "GET /battery")
            assert (status, 0.9 < answer["percentage"] < 1.0) == (200, True)
            assert await asked(port, "POST /charge") == (200, {"success": True, "message": "full"})
            assert (await asked(port, "GET /nothing"))[0] == 404

    asyncio.run(check())
