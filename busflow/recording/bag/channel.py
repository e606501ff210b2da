"""`Channel` and `Entry`: one topic of a bag with its type, and one message on it; how both become values."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, cast

from busflow.errors import BagError, InvalidDefinition, MalformedMessage

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.interfaces.message import Message

    MessageT = TypeVar("MessageT", bound=Message)

_ROS1 = "ros1"


@dataclass(frozen=True)
class Channel:
    """A topic of a bag. Two are equal if all but their counts and publishers is."""

    topic: str
    type_name: str
    """`sensor_msgs/msg/Imu`."""
    encoding: str
    """The encoding of the messages, in MCAP's word: `cdr`, `json`, or one that busflow does not read."""
    definition: str
    """The type as text; empty where the bag has none, or where the type has no fields."""
    definition_encoding: str
    """The format of the definition: `ros2msg`, `jsonschema`, or one that busflow does not read."""
    type_hash: str | None = None
    """`RIHS01_…`, where the recorder has written it."""
    qos: str | None = None
    """The QoS that the publishers offered, as ROS 2 writes it in a bag."""
    count: int | None = field(default=None, compare=False)
    """The number of messages; None if it is not known."""
    publishers: str = field(default="", compare=False)
    """The names of the nodes that have published, e.g. `/left, /right`, where the recorder has written them."""

    @cached_property
    def publisher_names(self) -> tuple[str, ...]:
        """The name of each node that has published, where the recorder has written them."""
        return tuple(name for each in self.publishers.split(",") if (name := each.strip()))

    @cached_property
    def type(self) -> ForeignType:
        """The type, by which messages are read without its class.

        Raises:
            BagError: It is encoded or described in a way that is not read, or not described at all.
        """
        from busflow.interfaces.encoding.foreign import ForeignType

        if self.encoding == "json":
            return _json_type(self)
        if self.encoding != "cdr":
            one = "a bag of ROS 1 is converted by rosbags-convert" if self.encoding == _ROS1 else None
            raise _error(self, f"is encoded as {self.encoding!r}; cdr and json are read", one)
        from busflow.interfaces.encoding.description import rihs01

        description = _description(self)
        full_name = description["type_description"]["type_name"]  # a bag may leave its middle part out
        return ForeignType(full_name, rihs01(description), description)

    @cached_property
    def fault(self) -> BagError | None:
        """The reason why messages of this channel cannot be read; None if they can."""
        try:
            _ = self.type
        except BagError as error:
            return error.with_traceback(None)  # its place is where it is raised
        return None

    def plain(self, payload: bytes | memoryview) -> Any:
        """Return a message as plain data: dictionaries, tuples, memoryviews, text and numbers.

        Raises:
            BagError: Messages of this channel cannot be read.
            MalformedMessage: This one cannot.
        """
        return self._plain(payload)

    def decode(self, payload: bytes | memoryview, cls: type[MessageT]) -> MessageT:
        """Return a message as one of the class that has this type.

        Raises:
            BagError: The class is of another type, or of another version of it.
            MalformedMessage: The bytes are no message.
        """
        decode = self._decoders.get(cls)
        if decode is None:
            decode = self._decoders[cls] = self._decoder(cls)
        return cast("MessageT", decode(payload))

    @cached_property
    def _plain(self) -> Callable[[Any], Any]:
        return self.type.decode

    @cached_property
    def _decoders(self) -> dict[Any, Callable[[Any], Any]]:
        return {}

    def _decoder(self, cls: type[Message]) -> Callable[[Any], Any]:
        from busflow.interfaces.encoding.typesupport import TypeSupport

        support = TypeSupport(cls)
        if self.type_name != support.name != self.type.name:
            raise _error(self, f"is no {support.name}")
        if support.encoding != self.encoding:
            raise _error(self, f"is encoded as {self.encoding!r}, and the class {cls.__name__} as {support.encoding}")
        recorded = self.type_hash or self.type.type_hash
        if recorded != support.type_hash:
            fix = "compare the class with what `busflow bag info --types` shows"
            raise _error(self, f"is another version of the type than the class {cls.__name__}", fix)
        return support.decode


class Entry(NamedTuple):
    """A message of a bag."""

    channel: Channel
    sequence: int
    """Its number: in a recording of busflow counted over all messages, elsewhere as the recorder chose it."""
    log_time_ns: int
    publish_time_ns: int
    payload: bytes


def unreadable(channels: Collection[Channel], fault: Callable[[Channel], BagError | None]) -> dict[Channel, BagError]:
    """Return the channels that are of no use, each with the reason that `fault` returns.

    Raises:
        BagError: There are channels, and none is of use.
    """
    found = {each: reason for each in channels if (reason := fault(each)) is not None}
    if found and len(found) == len(channels):
        raise next(iter(found.values()))
    return found


def _error(channel: Channel, why: str, fix: str | None = None) -> BagError:
    return BagError(f"{channel.topic}, {channel.type_name or 'without a type'}, {why}", fix=fix)


def _json_type(channel: Channel) -> ForeignType:
    import json

    from busflow.interfaces.encoding import json_form
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.interfaces.encoding.viewer_schema import source_schema

    try:
        schema = source_schema(json.loads(channel.definition or "{}"))
        type_hash = json_form.type_hash(schema)
    except (ValueError, AttributeError, TypeError, RecursionError):
        raise _error(channel, "is described by no JSON Schema") from None
    return ForeignType(channel.type_name, type_hash, schema)


def _description(channel: Channel) -> Any:
    """Return the description of a ROS 2 type: what the bag says, or what is known of a type that the bag only names."""
    from busflow.definitions.folders import library
    from busflow.definitions.recorded import parse
    from busflow.interfaces.encoding.builtin_types import builtin_types
    from busflow.interfaces.encoding.description import rihs01
    from busflow.interfaces.encoding.msg_text import ENCODING

    try:
        if channel.definition_encoding == ENCODING:
            read = parse(channel.type_name, channel.definition)
            # Without a text it has no fields, or its recorder did not know them: the hash tells.
            if channel.definition.strip() or channel.type_hash == rihs01(read):
                return read
        defined = channel.type_name in library()
        known = (library() if defined else builtin_types()).description(channel.type_name)
    except (MalformedMessage, InvalidDefinition) as error:
        raise _error(channel, f"has a definition that cannot be read: {error}") from None
    except KeyError:
        if channel.definition_encoding == ENCODING and channel.type_hash is None:
            return parse(channel.type_name, channel.definition)
        how = f"as {channel.definition_encoding}" if channel.definition else "nowhere in the bag"
        raise _error(channel, f"is described {how}; ros2msg is read") from None
    if channel.type_hash not in (None, rihs01(known)):
        whose = "the definition files have" if defined else "busflow brings"
        raise _error(channel, f"is another version of the type than the one that {whose}")
    return known
