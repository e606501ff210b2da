"""Schedule: one order of events among those that are possible, drawn by a seed or given choice by choice.

Where the order is not promised, the dispatcher and the loop ask a schedule. Every answer is a number, and 0 is first
in, first out. The answers of a seed can be recorded and given again, and set back towards the plain order until only
what matters is left.
"""

from __future__ import annotations

import asyncio
import random
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from contextvars import Context, copy_context
from enum import StrEnum
from typing import Any, TypeAlias

from busflow.bus.dispatcher import Runnable
from busflow.bus.services.server import Server
from busflow.bus.subscription import Subscription
from busflow.bus.timer import Timer
from busflow.clock import NS_PER_S

_REST_EVERY = 4  # turns, on average, after which the dispatcher lets others go first


class Lever(StrEnum):
    """Kinds of choices."""

    PICK = "pick"
    SHARE = "share"
    REST = "rest"
    STEP = "step"


Place: TypeAlias = tuple[int, Lever, int]
"""Where in a run a choice is: the virtual time in ns, the lever, and its number among those of that lever then.

To set one choice back moves no other one to a different place, but for those of its own lever and instant."""


class Schedule:
    """One order of events.

    Args:
        seed: Draws the choices.
        given: Without a seed, what to choose where; everywhere else it is first in, first out.
        record: Whether to keep `choices` and `explanations`.
    """

    def __init__(
        self, seed: int | None = None, *, given: Mapping[Place, int] | None = None, record: bool = False
    ) -> None:
        self.choices: dict[Place, int] = {}
        """Choices other than first in, first out, where they are recorded."""
        self.explanations: list[str] = []
        """Effect of each of these choices, in words."""
        self._draw = None if seed is None else random.Random(seed).random  # noqa: S311  # a schedule, not a secret
        self._given = given or {}
        self._record = record
        self._instant_ns = 0
        self._asked: Counter[Lever] = Counter()
        self._now_ns: Callable[[], int] = lambda: 0
        self._tasks: dict[int, asyncio.Task[Any]] = {}

    def attach(self, loop: asyncio.AbstractEventLoop, now_ns: Callable[[], int]) -> None:
        """Read times from this loop."""
        self._now_ns = now_ns
        if self._record:
            loop.set_task_factory(self._remembered_task)

    # What the dispatcher asks.

    def pick(self, ready: Sequence[Runnable]) -> int:
        """Choose the endpoint in line that has its turn."""
        if len(ready) < 2:
            return 0
        return self._choose(Lever.PICK, len(ready), lambda chosen: _overtaking(_names_in_line(ready), chosen))

    def share(self, most: int) -> int:
        """Choose how many messages the endpoint may handle."""
        return most - self._choose(Lever.SHARE, most, lambda chosen: f"a turn of at most {most - chosen} messages")

    def rests(self) -> bool:
        """Choose whether other callbacks go first although more endpoints wait in line."""
        rest = _REST_EVERY - 1
        chosen = self._choose(
            Lever.REST, _REST_EVERY, lambda _: "tasks and timers before the messages that wait", only=rest.__eq__
        )
        return chosen == rest

    # What the loop asks.

    def step(self, ready: Sequence[asyncio.Handle]) -> int:
        """Choose the next callback: a task's step or a timer may overtake, everything else stays in line."""
        return self._choose(
            Lever.STEP,
            len(ready),
            lambda chosen: _overtaking([self._name_of_callback(each) for each in ready], chosen),
            only=lambda chosen: _may_overtake(ready[chosen]),
        )

    # Choosing.

    def _choose(
        self,
        lever: Lever,
        options: int,
        explain: Callable[[int], str],
        *,
        only: Callable[[int], bool] = lambda _: True,
    ) -> int:
        """Choose a number below `options`; 0 replaces a given one that is not possible."""
        place: Place | None = None
        if self._record or self._given:
            place = self._place(lever)
        if self._draw is not None:
            chosen = int(self._draw() * options)
        else:
            chosen = min(self._given.get(place, 0), options - 1) if place else 0
        if chosen == 0 or not only(chosen):
            return 0
        if place and self._record:
            self.choices[place] = chosen
            self.explanations.append(f"{explain(chosen)} at t = {place[0] / NS_PER_S:.9g} s")
        return chosen

    def _place(self, lever: Lever) -> Place:
        now_ns = self._now_ns()
        if now_ns != self._instant_ns:
            self._instant_ns = now_ns
            self._asked.clear()
        self._asked[lever] += 1
        return now_ns, lever, self._asked[lever]

    def _name_of_callback(self, handle: asyncio.Handle) -> str:
        callback, context = getattr(handle, "_callback", None), getattr(handle, "_context", None)
        owner = getattr(callback, "__self__", None)
        if isinstance(owner, Timer):
            return f"the timer `{owner.name}` of `{owner.node}`"
        task = self._tasks.get(id(context))
        if task is not None:
            return f"the task `{task.get_name()}`"
        return f"`{getattr(callback, '__qualname__', type(callback).__name__)}`"

    def _remembered_task(
        self,
        loop: asyncio.AbstractEventLoop,
        coroutine: Any,
        context: Context | None = None,
        **options: Any,
    ) -> asyncio.Task[Any]:
        """Return a task that is recognised by its context, the only trace of it in its callbacks."""
        context = copy_context() if context is None else context
        task = asyncio.Task(coroutine, loop=loop, context=context, **options)
        self._tasks[id(context)] = task
        return task


class AnyOrder(deque[asyncio.Handle]):
    """Ready callbacks of a loop, in the order of a schedule."""

    def __init__(self, handles: deque[asyncio.Handle], schedule: Schedule) -> None:
        super().__init__(handles)
        self._step = schedule.step

    def popleft(self) -> asyncio.Handle:
        """Return the next callback."""
        if len(self) > 1 and (chosen := self._step(self)):
            handle = self[chosen]
            del self[chosen]
            return handle
        return super().popleft()


def _overtaking(names: list[str], chosen: int) -> str:
    overtaken = dict.fromkeys(name for name in names[:chosen] if name != names[chosen])
    return f"{names[chosen]} before {' and '.join(overtaken) or 'its equals'}"


def _names_in_line(ready: Sequence[Runnable]) -> list[str]:
    """Names that distinguish the endpoints in line: topics if all are of one node, nodes if all are of one topic."""
    places = [_place_in_line(each) for each in ready]
    topics, nodes = ({place[part] for place in places} for part in (0, 1))
    if len(nodes) == 1:
        return [f"`{topic}`" for topic, _ in places]
    if len(topics) == 1:
        return [f"`{node}`" for _, node in places]
    return [f"`{topic}` of `{node}`" for topic, node in places]


def _place_in_line(runnable: Runnable) -> tuple[str, str]:
    """Return the topic or service, and the node, of one in line."""
    if isinstance(runnable, Subscription):
        return runnable.topic, runnable.endpoint.node
    return (runnable.service, runnable.node) if isinstance(runnable, Server) else ("", "")


def _may_overtake(handle: asyncio.Handle) -> bool:
    """Return whether the callback is a timer's, or starts or wakes a task; transports need the order of all others."""
    if isinstance(handle, asyncio.TimerHandle):
        return True
    callback = getattr(handle, "_callback", None)
    if isinstance(getattr(callback, "__self__", None), asyncio.Task):
        return True
    return type(callback).__name__ in {"TaskStepMethWrapper", "TaskWakeupMethWrapper"}  # C, without `__self__`
