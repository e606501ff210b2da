"""Small recordings as `mcap` writes them, finished or not."""

from struct import pack

import pytest
from mcap.writer import CompressionType, Writer

from busflow.interfaces.encoding.typesupport import TypeSupport


def write_numbers(
    path, count=1000, *, topic="/number", first=0, finish=True, compression=CompressionType.ZSTD, **settings
):
    """A recording of so many numbers on a topic, 10 ms apart; its path."""
    with path.open("wb") as stream:
        writer = Writer(stream, **{"chunk_size": 2000, "compression": compression} | settings)
        writer.start("ros2", "a test")
        schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data\n")
        channel = writer.register_channel(topic, "cdr", schema)
        for index in range(count):
            time_ns = index * 10_000_000
            writer.add_message(channel, time_ns, b"\0\1\0\0" + pack("<d", first + index), time_ns, index + 1)
        if finish:
            writer.finish()
        else:
            writer.flush()
    return path


@pytest.fixture
def numbers(tmp_path):
    """A finished recording of 1000 numbers."""
    return write_numbers(tmp_path / "numbers.mcap")


def write_messages(path, messages, *, metadata=(), ledger=None):
    """A recording of (topic, message, time in ns), as busflow writes it; its path."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=64 << 10, compression=CompressionType.ZSTD)
        writer.start("ros2", "a test")
        for name, data in metadata:
            writer.add_metadata(name, data)
        channels = {}
        for number, (topic, message, time_ns) in enumerate(messages, start=1):
            support = TypeSupport(type(message))
            if topic not in channels:
                text = support.definition.encode()
                schema = writer.register_schema(support.name, support.definition_encoding, text)
                told = {"topic_type_hash": support.type_hash}
                channels[topic] = writer.register_channel(topic, support.encoding, schema, told)
            writer.add_message(channels[topic], time_ns, support.encode(message), time_ns, number)
        if ledger is not None:
            writer.add_metadata("busflow.ledger", ledger)
        writer.finish()
    return path


@pytest.fixture
def record(tmp_path):
    """Writes a recording of messages, each with its topic and its time in ns."""
    return lambda messages, name="run.mcap", **more: write_messages(tmp_path / name, messages, **more)
