"""LastErrors: the errors that a run logged just before its end; the run can no longer be asked for them."""

from __future__ import annotations

from collections import deque
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from busflow.clock import SystemClock
from busflow.errors import MalformedMessage
from busflow.text import printable
from busflow_ui.foxglove.kept_log import ROSOUT

if TYPE_CHECKING:
    from busflow.commands import Listener
    from busflow_ui.foxglove.bridge import Bridge

_ERROR = 40
_RECENT_S = 5.0
"""How long before the end an error may be its reason; an older one was survived."""
_DEPTH = 200
_MOST = 20
_MOST_TEXT = 500


class LastErrors:
    """Listens to the log of a run from `follow` until `close`."""

    def __init__(self, bridge: Bridge) -> None:
        self._bridge = bridge
        self._listening = ExitStack()
        self._listener: Listener | None = None
        self._decode: Any = None
        self._errors: deque[tuple[float, str]] = deque(maxlen=_MOST)
        """When each was read, on this machine's clock (the run's may be another one), and what it says."""
        self._clock = SystemClock()

    def follow(self) -> None:
        """Read what was logged; called about once a second. The first call listens, once the run has a log."""
        found = (each for each in self._bridge.catalogue.channels.values() if each.topic.name == ROSOUT)
        channel = next(found, None)
        if self._listener is None and channel is not None:
            feed = self._bridge.peer.listen(channel.topic, channel.type, depth=_DEPTH)
            self._listener = self._listening.enter_context(feed)
            self._decode = channel.type.decode
        self._read()

    def recent(self) -> list[str]:
        """Return the errors of the last seconds, oldest first."""
        self._read()
        oldest_s = self._clock.seconds() - _RECENT_S
        return [text for at_s, text in self._errors if at_s >= oldest_s]

    def _read(self) -> None:
        while self._listener is not None and (received := self._listener.get(0)) is not None:
            try:
                line = self._decode(received.payload)
                if line["level"] >= _ERROR:
                    text = printable(f"{line['name']}: {line['msg']}", limit=_MOST_TEXT)
                    self._errors.append((self._clock.seconds(), text))
            except (MalformedMessage, KeyError, TypeError):  # another program's type of this name
                continue

    def close(self) -> None:
        """Listen no more."""
        self._listening.close()
