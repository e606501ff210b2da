"""Rng: a node's own generator of random numbers; imported where one is asked for, since `numpy.random` takes 3 MB."""

from __future__ import annotations

import numpy as np

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
