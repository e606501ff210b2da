"""A node that a worker process is assigned, and what it does then."""

import asyncio
import gc
import os

from busflow import Node, Parameters, timeouts


class OwnParameters(Parameters):
    """One word: `end`, `wait`, `fail`, or `collect` for the collection of garbage."""

    then: str = "end"


class Own(Node):
    """Logs what its process is like."""

    parameters: OwnParameters

    async def run(self) -> None:
        values = [os.environ.get(name) for name in ("OWN", "OUTER", "GONE")]
        self.log.info("ready", values=values, nice=os.nice(0), grace=timeouts.current.grace)
        match self.parameters.then:
            case "wait":
                await asyncio.Event().wait()
            case "fail":
                raise AttributeError("absent")
            case "collect":
                while gc.get_freeze_count() < 1000:
                    await self.clock.sleep(0.01)
                self.log.info("frozen", thresholds=gc.get_threshold())
            case _:
                pass
