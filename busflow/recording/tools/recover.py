"""Recovery: a finished file with what can still be read of a recording that was cut off or damaged.

Damaged chunks are left out, and what follows them is kept. The file states that it was recovered, so that it is never
taken for a complete recording.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from mcap import records
from mcap.writer import Writer

from busflow.errors import BagError
from busflow.recording.bag.bag import Bag
from busflow.recording.bag.facts import FACTS, LEDGER, PART, joined, part_of
from busflow.recording.bag.mcap_file import McapFile
from busflow.recording.mcap.contents import Contents
from busflow.recording.mcap.writer import CHUNK_BYTES
from busflow.recording.recorder.provenance import library
from busflow.recording.tools.target import new_file


@dataclass(slots=True)
class Recovery:
    """The account of a recovery: what was saved, and what was not."""

    target: Path
    messages: int = 0
    attachments: int = 0
    metadata: int = 0
    damages: list[BagError] = field(default_factory=list[BagError])
    """The reasons why something may be missing; none for an undamaged file."""
    missing: int | None = None
    """The messages that are known to be missing by their numbers; None where messages were not numbered."""
    strays: int = 0
    """Messages whose topic is not known any more, which were not saved."""


def recover(source: Path, target: Path, on_message: Callable[[], None] = lambda: None) -> Recovery:
    """Write what can be read of `source` to `target`, which must not exist.

    Raises:
        BagError: The source is no recording, or the target cannot be written.
    """
    with Bag(source) as bag:
        paths = [each.path for each in bag.files if isinstance(each, McapFile)]
        if len(paths) < len(bag.files):
            raise BagError(
                "a database, or a compressed bag, is not recovered", file=str(source), fix="sqlite3 has .recover"
            )
        if len(bag.series) > 1:
            fix = "busflow bag convert --to mcap makes one of what can be read; or recover each file by its name"
            raise BagError("it has a file for each process, in no order of their own", file=str(source), fix=fix)
    with new_file(target) as part, part.open("wb") as stream:
        saved = _Saved(Writer(stream, chunk_size=CHUNK_BYTES, enable_data_crcs=True), Recovery(target), on_message)
        for path in paths:
            with Contents(path) as contents:
                saved.take(contents)
        saved.finish()
    return saved.recovery


class _Saved:
    """The new file, while it is written."""

    def __init__(self, writer: Writer, recovery: Recovery, on_message: Callable[[], None]) -> None:
        self.recovery = recovery
        self._writer, self._on_message = writer, on_message
        self._schema_ids: dict[tuple[str, str, bytes], int] = {}
        self._channel_ids: dict[tuple[object, ...], int] = {}
        self._here: dict[int, int] = {}
        """The new number of each channel of the file that is read."""
        self._schemas: dict[int, records.Schema] = {}
        self._facts = False
        self._last = self._gaps = 0
        self._ledger: dict[str, str] | None = None
        self._earlier: list[dict[str, str]] = []
        """The ledgers of earlier parts."""
        self._started = self._again = False

    def take(self, contents: Contents) -> None:
        """Save what is in a file."""
        summary = contents.summary  # what was declared in a damaged chunk is declared there once more
        self._here, self._schemas = {}, {} if summary is None else dict(summary.schemas)
        later = [] if summary is None else list(summary.channels.values())
        for found in contents.beyond_damage():
            self._record(found.record, later)
        self.recovery.damages += contents.damages

    def finish(self) -> None:
        """Write the ledger, and end the file."""
        recovery = self.recovery
        recovery.missing = self._gaps if self._facts else None
        if not self._started:
            self._writer.start("", library())
        if recovery.damages or (self._facts and self._ledger is None):
            self._writer.add_metadata(LEDGER, self._marked())
        elif self._ledger is not None:
            self._writer.add_metadata(LEDGER, self._whole(self._ledger))
        self._writer.finish()

    def _marked(self) -> dict[str, str]:
        """Return the ledger of a file that may be incomplete."""
        recovery = self.recovery
        before = (self._ledger and self._whole(self._ledger)) or {
            "report": json.dumps({}),
            "missed": "0",
            "recorded": str(recovery.messages),
        }
        reasons = "; ".join(str(each.reason) for each in recovery.damages[:3]) or "it was not finished"
        return {**before, "complete": "false", "recovered": reasons}

    def _whole(self, ledger: dict[str, str]) -> dict[str, str]:
        """Return the ledger of all parts."""
        whole = dict(joined([*self._earlier, ledger]))
        whole.pop("continued", None)
        return whole

    def _begin_part(self, metadata: dict[str, str]) -> None:
        """Begin a part, of which all but the first repeat what was saved."""
        self._again = self.recovery.messages > 0
        if not self._again:
            self._last = part_of(metadata).first - 1
        self._earlier += [] if self._ledger is None else [self._ledger]
        self._ledger = None

    def _record(self, record: object, later: list[records.Channel]) -> None:
        writer = self._writer
        match record:
            case records.Message():
                self._message(record, later)
            case records.Schema():
                self._schemas[record.id] = record
            case records.Channel():
                self._channel(record)
            case records.Header() if not self._started:
                writer.start(record.profile, f"{library()}, recovered from {record.library}")
                self._started = True
            case records.Metadata(name=name, metadata=metadata) if name == LEDGER:
                self._ledger = metadata
            case records.Metadata(name=name, metadata=metadata) if name == PART:
                self._begin_part(metadata)
                if not self._again and part_of(metadata).begins_later:
                    writer.add_metadata(name, metadata)
            case records.Metadata() | records.Attachment() if self._again:
                pass
            case records.Metadata(name=name, metadata=metadata):
                self._facts = self._facts or name == FACTS
                self.recovery.metadata += 1
                writer.add_metadata(name, metadata)
            case records.Attachment():
                self.recovery.attachments += 1
                writer.add_attachment(record.create_time, record.log_time, record.name, record.media_type, record.data)
            case _:
                pass

    def _message(self, message: records.Message, later: list[records.Channel]) -> None:
        if self._again and not message.sequence:
            return
        if message.channel_id not in self._here:
            for channel in later:
                self._channel(channel)
        number = self._here.get(message.channel_id)
        if number is None:
            self.recovery.strays += 1
            return
        self._writer.add_message(number, message.log_time, message.data, message.publish_time, message.sequence)
        self.recovery.messages += 1
        self._gaps += max(0, message.sequence - self._last - 1)
        self._last = message.sequence or self._last
        self._on_message()

    def _channel(self, channel: records.Channel) -> None:
        if channel.id in self._here:
            return
        schema = self._schemas.get(channel.schema_id)
        if schema is None and channel.schema_id:
            return
        number = 0 if schema is None else self._schema_id(schema)
        key = (channel.topic, channel.message_encoding, number, *sorted(channel.metadata.items()))
        if key not in self._channel_ids:
            self._channel_ids[key] = self._writer.register_channel(
                channel.topic, channel.message_encoding, number, channel.metadata
            )
        self._here[channel.id] = self._channel_ids[key]

    def _schema_id(self, schema: records.Schema) -> int:
        key = (schema.name, schema.encoding, schema.data)
        if key not in self._schema_ids:
            self._schema_ids[key] = self._writer.register_schema(*key)
        return self._schema_ids[key]
