"""`Sink`: writes the messages of a bag in another form; `TopicFiles` writes a directory with a file for each topic."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from busflow.errors import BagError

if TYPE_CHECKING:
    from busflow.recording.bag.channel import Channel, Entry

MOST_FILES = 500
"""Files that are written side by side; an operating system allows about a thousand."""
_LONGEST = 150
_UNSAFE = re.compile(r"[^A-Za-z0-9_.-]+")


class Sink(Protocol):
    """A target of messages."""

    def write(self, entry: Entry) -> None:
        """Take a message.

        Raises:
            BagError: It cannot be written in this form.
            MalformedMessage: It cannot be read by its type.
        """
        ...

    def close(self) -> None:
        """Write what is left, and the end."""
        ...


class FileNames:
    """A file name for each channel: of its topic, without characters that are special to a file system or a shell."""

    def __init__(self, suffix: str) -> None:
        self._suffix = suffix
        self._names: dict[Channel, str] = {}

    def of(self, channel: Channel) -> str:
        """Return the name of a channel's file; no two names differ in upper and lower case only."""
        if channel not in self._names:
            taken = {name.lower() for name in self._names.values()}
            stem = _UNSAFE.sub("_", channel.topic.strip("/")).lstrip(".-_")[:_LONGEST] or "topic"
            number, name = 1, f"{stem}{self._suffix}"
            while name.lower() in taken:
                number += 1
                name = f"{stem}-{number}{self._suffix}"
            self._names[channel] = name
        return self._names[channel]


class TopicFiles:
    """Writes a directory with a file for each topic, which is begun with the first message of the topic."""

    def __init__(self, directory: Path, suffix: str, new_file: Callable[[Path, Channel], Sink]) -> None:
        self._directory, self._names, self._new_file = directory, FileNames(suffix), new_file
        self._files: dict[Channel, Sink] = {}

    def write(self, entry: Entry) -> None:
        """Write a message into the file of its topic.

        Raises:
            BagError: There are too many topics, or one cannot be written in this form.
            MalformedMessage: The message cannot be read by its type.
        """
        channel = entry.channel
        file = self._files.get(channel)
        if file is None:
            if len(self._files) >= MOST_FILES:
                reason = f"it has more than {MOST_FILES} topics, and each becomes a file"
                raise BagError(reason, fix="pick some with --topics")
            file = self._files[channel] = self._new_file(self._directory / self._names.of(channel), channel)
        file.write(entry)

    def close(self) -> None:
        """Write what is left, and close the files."""
        for file in self._files.values():
            file.close()
