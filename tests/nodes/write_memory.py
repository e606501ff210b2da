"""A program that writes two messages into an arena and prints their places."""

from busflow.wire.shared_memory.arena import Arena

arena = Arena(1000)
for number in (7, 8):
    print(arena.write([bytes([number] * 50)], 50).encode().hex(), flush=True)
input()
