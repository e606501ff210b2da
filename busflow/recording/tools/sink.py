"""`Sink`: what takes the messages of a bag and writes them in another form; and what files of topics are called."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from busflow.recording.bag.channel import Channel, Entry

MOST_FILES = 500
"""Files that are written side by side; an operating system allows about a thousand."""
_LONGEST = 150
_UNSAFE = re.compile(r"[^A-Za-z0-9_.-]+")


class Sink(Protocol):
    """Where messages go."""

    def write(self, entry: Entry) -> None:
        """Take a message.

        Raises:
            BagError: It cannot be written so.
            MalformedMessage: It cannot be read by its type.
        """
        ...

    def close(self) -> None:
        """Write what is left, and the end."""
        ...


class FileNames:
    """A file name for each channel: of its topic, without anything that a file system or a shell could take amiss."""

    def __init__(self, suffix: str) -> None:
        self._suffix = suffix
        self._names: dict[Channel, str] = {}

    def of(self, channel: Channel) -> str:
        """The name of the file of a channel; two never share one, also where upper and lower case are one."""
        if channel not in self._names:
            taken = {name.lower() for name in self._names.values()}
            stem = _UNSAFE.sub("_", channel.topic.strip("/")).lstrip(".-_")[:_LONGEST] or "topic"
            number, name = 1, f"{stem}{self._suffix}"
            while name.lower() in taken:
                number += 1
                name = f"{stem}-{number}{self._suffix}"
            self._names[channel] = name
        return self._names[channel]
