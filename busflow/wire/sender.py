"""Sender: the one thread that does what may wait for the link, so that the loop never does.

A message of some hundred bytes is handed to Zenoh in a microsecond, whoever reads it and however slowly. A large one is
copied and cut into pieces, and the first one that a stalled reader has no room for waits up to 50 ms (measured).
"""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Callable

LARGE = 64 * 1024
"""Payloads from this size on leave through the sender, bytes."""
_DEPTH = 64
"""What may wait to be sent; the oldest gives way."""
_PATIENCE_S = 5.0


class Sender:
    """Runs what it is handed, one after the other, in a thread of its own."""

    def __init__(self) -> None:
        self.dropped = 0
        self._work: deque[tuple[object, Callable[[], None]]] = deque()
        self._unfinished: Counter[object] = Counter()
        self._arrived = threading.Condition()
        self._closed = False
        self._thread: threading.Thread | None = None

    def busy(self, lane: object) -> bool:
        """Whether something of this lane is still to be done: what is small must not overtake what is large."""
        return self._unfinished[lane] > 0

    def hand(self, lane: object, work: Callable[[], None]) -> None:
        """Do this soon; when too much waits already, the oldest is not done and counted as dropped."""
        with self._arrived:
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="busflow.sender", daemon=True)
                self._thread.start()
            if len(self._work) >= _DEPTH:
                self._drop_oldest()
            self._work.append((lane, work))
            self._unfinished[lane] += 1
            self._arrived.notify()

    def close(self) -> None:
        """Take no more; what waits is dropped. The session has to be closed before, which wakes a waiting put."""
        with self._arrived:
            self._closed = True
            while self._work:
                self._drop_oldest()
            self._arrived.notify()
        if self._thread is not None:
            self._thread.join(_PATIENCE_S)

    def _drop_oldest(self) -> None:
        lane, _ = self._work.popleft()
        self._unfinished[lane] -= 1
        self.dropped += 1

    def _run(self) -> None:
        while True:
            with self._arrived:
                while not self._work:
                    if self._closed:
                        return
                    self._arrived.wait()
                lane, work = self._work.popleft()
            try:
                work()
            finally:
                with self._arrived:
                    self._unfinished[lane] -= 1
