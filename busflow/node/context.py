"""Surroundings: what a node is given from outside, its generator of random numbers among it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from busflow.bus.qos import QoS

if TYPE_CHECKING:
    from busflow.clock import Clock
    from busflow.log import Log
    from busflow.node.parameter_store import ValueSource


_BEYOND_BYTES = 256
"""Makes the number of a life unlike any byte of a name."""


class Rng(np.random.Generator):
    """A numpy generator that can go back to where it began."""

    def __init__(self, seed: int, name: str, life: int = 0) -> None:
        """Create a node's generator from the run's seed, the node's full name, and its number of restarts."""
        key = (*name.encode(), *((_BEYOND_BYTES + life,) if life else ()))
        super().__init__(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
        self._beginning = self.bit_generator.state

    def reseed(self) -> None:
        """Start the sequence over."""
        self.bit_generator.state = self._beginning


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Surroundings of a node: names, overrides, and the run's clock, log and seed."""

    clock: Clock
    log: Log
    seed: int = 0
    namespace: str = "/"
    remaps: Mapping[str, str] = field(default_factory=dict[str, str])
    publisher_qos: Callable[[str], tuple[QoS, ...]] = lambda _topic: ()
    """The launch file's layers of QoS for each publisher of this node, by final topic name."""
    subscription_qos: Callable[[str], tuple[QoS, ...]] = lambda _topic: ()
    parameter_source: Callable[[str], ValueSource | None] = lambda _name: None
    """The place in the launch file or on the command line of each parameter of this node, by dotted name."""
    folder: Path = Path()
    """The folder of the launch file that names the node's plugin; the working directory where there is none."""
    packages: Mapping[str, Path] = field(default_factory=dict[str, Path])
    """The folders of `packages:` of the launch file, by name."""
    life: int = 0
    """The number of restarts of the node."""
