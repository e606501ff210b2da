"""A program that reads messages at the places that are typed into it."""

import sys

from busflow.wire.shared_memory.place import MemoryPlace
from busflow.wire.shared_memory.reader import MemoryReader

reader = MemoryReader("child")
for line in sys.stdin:
    data = reader.read(MemoryPlace.decode(bytes.fromhex(line)))
    print(data is not None and (len(data), len(set(data)), data[0]), flush=True)
