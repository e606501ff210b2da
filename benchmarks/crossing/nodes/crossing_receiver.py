"""The receiver of busflow's own way: a node whose handler notes what it is given."""

import os
from pathlib import Path

from benchmarks.crossing.board import Board
from benchmarks.crossing.messages import KINDS
from busflow import Node, Parameters, QoS


class CrossingReceiverParameters(Parameters):
    kind: str = "block"
    folder: str = ""


class CrossingReceiver(Node):
    """Notes on the board what arrives."""

    parameters: CrossingReceiverParameters

    def declare(self) -> None:
        kind, take = KINDS[self.parameters.kind], Board(Path(self.parameters.folder) / "board").taker()
        number = kind.number
        if not kind.is_shared and hasattr(os, "memfd_create"):
            del os.memfd_create  # as on a system without such memory

        def hear(message: object) -> None:
            take(number(message))

        self.create_subscription(kind.type, "crossing", hear, qos=QoS(depth=3000))
