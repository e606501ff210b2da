"""Message classes for the types of a recording: a loaded class of that very type, or one that passes its bytes on."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from typing import TYPE_CHECKING

from busflow.errors import InvalidDeclaration, UnknownType
from busflow.interfaces.encoding.typesupport import OpaqueMessage, TypeSupport, opaque
from busflow.interfaces.message import Message, find_type, type_name

if TYPE_CHECKING:
    from busflow.recording.bag.channel import Channel


class MessageClasses:
    """The message classes that are loaded when a bag is opened, by the names of their types."""

    def __init__(self) -> None:
        self._loaded: defaultdict[str, list[type[Message]]] = defaultdict(list)
        for cls in _below(Message):
            self._loaded[_name(cls)].append(cls)

    def find(self, channel: Channel) -> type[Message]:
        """Return the class for the messages of a channel.

        That is the standard class of the name, else the one that was loaded last, if its type is the recorded one in
        every field; else a class of its own, whose messages are published as the recorded bytes.

        Raises:
            BagError: Messages of this channel cannot be read.
        """
        foreign = channel.type
        for cls in self._of_name(foreign.name):
            support = TypeSupport(cls)
            if support.encoding == channel.encoding and support.type_hash == foreign.type_hash:
                return cls
        return opaque(foreign)

    def _of_name(self, name: str) -> Iterator[type[Message]]:
        try:
            found = find_type(name)
        except UnknownType:
            found = None
        if found is not None and issubclass(found, Message):
            yield found
        yield from reversed(self._loaded.get(name, ()))


def _below(cls: type[Message]) -> Iterator[type[Message]]:
    for each in cls.__subclasses__():
        if each is not OpaqueMessage:
            yield each
            yield from _below(each)


def _name(cls: type[Message]) -> str:
    try:
        return type_name(cls)
    except InvalidDeclaration:  # a class that is not complete yet stands for no message
        return ""
