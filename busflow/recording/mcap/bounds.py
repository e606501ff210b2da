"""Limits on a recording: each is checked before anything is allocated.

A recording may come from anyone, and a few bytes of it can claim gigabytes. No robot records what a limit refuses.
"""

LARGEST_RECORD = 512 << 20
"""Bytes of a chunk, message or attachment as it lies in the file."""

LARGEST_DETAIL = 4 << 20
"""Bytes of any other record: a schema, a channel, metadata, what the summary holds."""

LARGEST_INDEX = 16 << 20
"""Bytes of a message index: of a channel's messages in one chunk, a million."""

LARGEST_CHUNK = 256 << 20
"""Bytes of a chunk that is unpacked."""

UNSUSPICIOUS_CHUNK = 64 << 20
"""Bytes up to which a chunk may have any ratio: a few black pictures compress to almost nothing."""

MOST_PACKED = 1000
"""The greatest ratio of a larger chunk's unpacked to its packed size."""

MOST_SUMMARY = 256 << 20
"""Bytes of the summary at the end of a file; the writer leaves out the index of the chunks rather than exceed it."""

MOST_DECLARED = 256 << 20
"""Bytes of schemas and channels in chunks, repeats included; all types of ROS 2 once take two million."""

MOST_FILES = 100_000
"""Files of a bag that was split."""
