"""MCAP's official conformance files: 409 ways of writing six small recordings.

Tests of `bounds.py`, `chunks.py`, `contents.py`, `records.py` and `summary.py`.
"""

import hashlib
from dataclasses import fields

import pytest
from mcap import records

from busflow.recording.bag.bag import Bag
from busflow.recording.mcap.chunks import Chunk
from busflow.recording.mcap.contents import Contents
from tests.vectors import FOLDER, cases

FILES = [case for case in cases("h_mcap_conformance") if "file" in case]
LEFT_OUT = (Chunk, records.MessageIndex)
"""The cases do not have these: chunks are opened, and the reader decides whether it needs their indices."""


def as_upstream(value):
    """A value in the form of the cases: numbers as text, bytes as lists of them."""
    match value:
        case bytes():
            return [str(each) for each in value]
        case int():
            return str(value)
        case dict():
            return {str(key): as_upstream(each) for key, each in value.items()}
        case _:
            return value


def as_case(record):
    """A record in the form of the cases."""
    told = {each.name: as_upstream(getattr(record, each.name)) for each in fields(record)}
    return type(record).__name__, told


def expected(case):
    return [(each["type"], dict(each["fields"])) for each in case["records"] if each["type"] != "MessageIndex"]


def test_all_files_are_there_and_those_of_upstream():
    assert len(FILES) == 409
    for case in FILES:
        content = (FOLDER / case["file"]).read_bytes()
        assert (hashlib.sha256(content).hexdigest(), len(content)) == (case["mcap_sha256"], case["mcap_size"])


@pytest.mark.parametrize("base", sorted({case["base"] for case in FILES}))
def test_every_record_is_read(base):
    for case in FILES:
        if case["base"] == base:
            with Contents(FOLDER / case["file"]) as contents:
                found = [as_case(each.record) for each in contents if not isinstance(each.record, LEFT_OUT)]
            assert found == expected(case), case["id"]


def test_a_bag_reads_every_conformance_file_whole():
    for case in FILES:
        messages = [dict(each["fields"]) for each in case["records"] if each["type"] == "Message"]
        topics = {dict(each["fields"])["topic"] for each in case["records"] if each["type"] == "Channel"}
        with Bag(FOLDER / case["file"]) as bag:
            served = [
                (str(each.sequence), str(each.log_time_ns), str(each.publish_time_ns), as_upstream(each.payload))
                for each in bag.entries()
            ]
            names = ("sequence", "log_time", "publish_time", "data")
            assert served == [tuple(each[name] for name in names) for each in messages], case["id"]
            assert {channel.topic for channel in bag.channels} == topics, case["id"]
            assert bag.messages == len(messages), case["id"]
            assert bag.complete, (case["id"], bag.incomplete)
