"""A web service of asyncio's own beside a graph: GET /battery answers with the newest state, POST /charge asks it.

    python examples/web_service/server.py &
    curl -s http://127.0.0.1:8080/battery

With aiohttp or Starlette the graph stands in the same place: inside their start-up and shutdown, on their event loop.
"""

import asyncio
import json
from contextlib import asynccontextmanager
from pathlib import Path

import busflow
from busflow.msgs.sensor_msgs import BatteryState
from busflow.msgs.std_srvs import Trigger

FILE = Path(__file__).parent / "robot.yaml"
LONGEST_LINE = 1024


class Service:
    """Answers requests from a graph."""

    def __init__(self, graph: busflow.Graph) -> None:
        self.graph = graph
        self.states = graph.subscribe(BatteryState, "battery")

    async def answer(self, request: str) -> tuple[str, dict[str, object]]:
        match request.split(" ")[:2]:
            case ["GET", "/battery"]:
                newest = self.states.latest
                return "200 OK", {"percentage": None if newest is None else newest.percentage}
            case ["POST", "/charge"]:
                answer = await self.graph.call(Trigger, "charge")
                return "200 OK", {"success": answer.success, "message": answer.message}
            case _:
                return "404 Not Found", {"error": "GET /battery or POST /charge"}

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer one request of a connection; headers and body are of no interest here."""
        try:
            async with asyncio.timeout(5):
                status, body = await self.answer((await reader.readline()).decode("latin-1"))
                text = json.dumps(body).encode()
                head = f"HTTP/1.1 {status}\r\nContent-Type: application/json\r\nContent-Length: {len(text)}\r\n"
                writer.write(f"{head}Connection: close\r\n\r\n".encode() + text)
                await writer.drain()
        except (TimeoutError, ValueError, ConnectionError):  # too slow, too long, or gone
            pass
        finally:
            writer.close()


@asynccontextmanager
async def served(port: int = 0):
    """The service while the block lasts; yields the graph, and the port at which it listens on this machine alone."""
    async with busflow.launch(FILE) as graph:
        server = await asyncio.start_server(Service(graph).serve, "127.0.0.1", port, limit=LONGEST_LINE)
        async with server:
            yield graph, server.sockets[0].getsockname()[1]


async def main() -> None:
    async with served(8080) as (graph, _):
        await graph.wait()


if __name__ == "__main__":
    asyncio.run(main())
