"""Limits on a recording: each is checked before anything is allocated.

A recording comes from anywhere, and a few bytes of it can claim gigabytes. What a bound refuses, no robot records.
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
"""Up to here a chunk may be packed however small: a few black pictures are nearly nothing."""

MOST_PACKED = 1000
"""The greatest ratio of a larger chunk's unpacked to its packed size."""

MOST_SUMMARY = 256 << 20
"""Bytes of the summary at the end of a file; that of a terabyte in small chunks has fewer."""

MOST_DECLARED = 256 << 20
"""Bytes of what chunks say of topics and types, the same again and again; once, all of ROS 2's have two million."""

MOST_FILES = 100_000
"""Files of a bag that was split."""
