"""`Announcer`: tells a file of its types and channels, each under a number and before the first message."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from busflow.recording.bag.offered_qos import offered_qos_profiles

if TYPE_CHECKING:
    from busflow.bus.qos import QoS
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.interfaces.encoding.typesupport import TypeSupport
    from busflow.recording.mcap.writer import McapWriter
    from busflow.recording.recorder.spool import Spool


class Announcer:
    """The numbers that the channels and types of one file have."""

    def __init__(self) -> None:
        # By the hash too: two classes of one name, or one that was edited, are two types.
        self._schemas: dict[tuple[str, str], int] = {}
        self._channels = 0

    def announce(self, spool: Spool, topic: str, type_: TypeSupport | ForeignType, offered: Iterable[QoS]) -> int:
        """Tell the file of a channel, and of its type where that is new; its number, 0 where nothing can be written."""
        number, key = self._channels + 1, (type_.name, type_.type_hash)
        known = self._schemas.get(key)
        schema = known or len(self._schemas) + 1
        metadata = _metadata(offered_qos_profiles(offered), type_.type_hash)

        def announce(file: McapWriter) -> None:
            if known is None:
                file.add_schema(schema, type_.name, type_.definition_encoding, type_.definition.encode())
            file.add_channel(number, topic, type_.encoding, schema, metadata)

        if not spool.do(announce):
            return 0
        self._schemas[key], self._channels = schema, number
        return number


def _metadata(offered: str, type_hash: str) -> Mapping[str, str]:
    """What ROS 2's recorder writes beside a channel."""
    return {"offered_qos_profiles": offered, "topic_type_hash": type_hash}
