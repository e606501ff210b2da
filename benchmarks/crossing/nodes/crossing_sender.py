"""The sender of busflow's own way: a node that the conductor publishes with."""

import json
from pathlib import Path
from typing import Any

from benchmarks.crossing import FLOOD, HELLO, RING
from benchmarks.crossing.board import Board
from benchmarks.crossing.conductor import Conductor
from benchmarks.crossing.messages import KINDS
from busflow import Node, Parameters, QoS


class CrossingSenderParameters(Parameters):
    kind: str = "block"
    size: int = 320
    seconds: float = 0.1
    folder: str = ""


class CrossingSender(Node):
    """Sends as the conductor has it, and writes down the figures."""

    parameters: CrossingSenderParameters

    def declare(self) -> None:
        kind = KINDS[self.parameters.kind]
        self.out = self.create_publisher(kind.type, "crossing", qos=QoS(depth=3000))

    async def run(self) -> None:
        given = self.parameters
        folder = Path(given.folder)
        make: Any = KINDS[given.kind].make
        ring = [make(given.size, number) for number in range(RING)]
        flood, hello = make(given.size, FLOOD), make(given.size, HELLO)
        conductor = Conductor(Board(folder / "board"), self.out.publish, ring, flood, hello)
        try:
            found = await conductor.run(given.size, given.seconds)
        except RuntimeError as error:
            found = {"failed": str(error)}
        (folder / "found.part").write_text(json.dumps(found))
        (folder / "found.part").rename(folder / "found.json")
