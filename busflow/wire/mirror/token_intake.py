"""Token intake: hands the tokens and queries of other sessions to the event loop, in order and a few at a time.

Any node of ROS 2 may show as many tokens as it likes, and change them as fast. So a token that changes before the loop
has handled it is handled once, as it is then; and of more tokens than a run could have, the later ones are ignored.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.bus.dispatcher import Dispatcher
    from busflow.log import Logger

MOST_TOKENS = 10_000
"""Limit of the tokens that are handled; a neighbour that shows more is faulty or malicious."""


class TokenIntake:
    """Tokens and queries that wait for the event loop."""

    def __init__(
        self,
        dispatcher: Dispatcher,
        on_loop: Callable[..., None],
        handle: Callable[[str, bool], None],
        log: Logger,
    ) -> None:
        """Create an empty intake.

        Args:
            dispatcher: says how long a turn of the loop may take.
            on_loop: runs a function on the event loop, from any thread.
            handle: called on the loop with a token's text, and whether it is there or gone.
            log: gets one line when the first token is ignored.
        """
        self.ignored: int = 0
        """Number of tokens that were ignored."""
        self._dispatcher, self._on_loop, self._token_handler, self._log = dispatcher, on_loop, handle, log
        self._there: set[str] = set()
        self._changed: dict[str, bool] = {}
        """By its text, whether a token is there that the loop has not handled yet."""
        self._waiting: deque[tuple[Callable[..., None], tuple[Any, ...]]] = deque()
        self._lock = threading.Lock()
        self._draining = False

    def take(self, text: str, alive: bool) -> None:
        """Take in a token that has come or gone; called in Zenoh's threads."""
        with self._lock:
            if alive and text not in self._there and len(self._there) >= MOST_TOKENS:
                self.ignored += 1
                if self.ignored > 1:
                    return
                work: tuple[Callable[..., None], tuple[Any, ...]] = self._warn, ()
            elif not alive and text not in self._there:
                return
            else:
                (self._there.add if alive else self._there.discard)(text)
                waits = text in self._changed
                self._changed[text] = alive
                if waits:
                    return
                work = self._handle, (text,)
        self.hand(work[0], *work[1])

    def hand(self, work: Callable[..., None], *arguments: Any) -> None:
        """Call a function on the loop, after everything that was taken in before; from any thread."""
        self._waiting.append((work, arguments))
        with self._lock:
            if self._draining:
                return
            self._draining = True
        self._on_loop(self._drain)

    def _drain(self) -> None:
        """Handle what waits until this turn's time is over."""
        started, handled = self._dispatcher.now(), 0
        try:
            while not self._dispatcher.spent(started, handled):
                with self._lock:
                    if not self._waiting:
                        self._draining = False
                        return
                    work, arguments = self._waiting.popleft()
                work(*arguments)
                handled += 1
        except BaseException:
            self._continue()
            raise
        self._continue()

    def _continue(self) -> None:
        asyncio.get_running_loop().call_soon(self._drain)

    def _handle(self, text: str) -> None:
        with self._lock:
            alive = self._changed.pop(text)
        self._token_handler(text, alive)

    def _warn(self) -> None:
        self._log.warning(f"other sessions show more than {MOST_TOKENS:,} tokens: further ones are ignored")
