"""Orders by hand: nodes of a running graph are stopped, started and restarted on request, the others go on."""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING

from busflow.errors import NotRunning

if TYPE_CHECKING:
    from busflow.runner.graph import Graph
    from busflow.runner.supervisor import Supervisor


class Order(StrEnum):
    """What is to be done with a node."""

    START = "start"
    """Start it, if it has ended or was stopped."""
    STOP = "stop"
    """Stop it until it is started by hand: no policy restarts it."""
    RESTART = "restart"
    """Stop it if it runs, and start it."""


class OrdersByHand:
    """Carries out orders one after another, on the event loop."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._turn = asyncio.Lock()
        self._tasks: set[asyncio.Task[None]] = set()

    def give(self, order: Order, names: Collection[str]) -> list[Supervisor]:
        """Begin to carry out an order; return its nodes, in the order of the graph. Unknown names are left out.

        Raises:
            NotRunning: the graph ends.
        """
        if self._graph.course.ending.is_set():
            raise NotRunning(f"the run {self._graph.name} ends")
        supervisors = [each for each in self._graph.supervisors if each.name in names]
        task = asyncio.get_running_loop().create_task(self._carry_out(order, supervisors), name=f"busflow.{order}")
        self._tasks.add(task)
        task.add_done_callback(self._ended)
        return supervisors

    def close(self) -> None:
        """Begin nothing more."""
        for task in self._tasks:
            task.cancel()

    async def _carry_out(self, order: Order, supervisors: Sequence[Supervisor]) -> None:
        async with self._turn:
            if order is not Order.START:
                running = [each for each in supervisors if not each.ended.is_set()]
                await self._graph.course.stop_by_hand(running)
                for supervisor in running:
                    supervisor.runtime.log.info("stopped by hand")
            if order is not Order.STOP:
                for supervisor in [each for each in supervisors if each.ended.is_set()]:
                    await self._graph.course.start_by_hand(supervisor)
                    supervisor.runtime.log.info("started by hand")
            for extension in self._graph.course.extensions:
                extension.order_carried_out()

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and (error := task.exception()) is not None:
            known = isinstance(error, NotRunning)
            self._graph.log.bind("busflow").error(str(error), **({} if known else {"exc_info": error}))
