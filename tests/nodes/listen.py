"""A program that listens to topics of a run: it prints when it receives the first, and how many of so many are lost."""

import sys

from busflow.wire.client.client import join

run, count, *names = sys.argv[1:]
with join(run) as peer:
    topics = [peer.graph().topic(name) for name in names]
    with peer.listen(topics[0]) as first, peer.listen(topics[-1]):
        first.get(60)
        print("listening", flush=True)
        for _ in range(int(count)):
            first.get(60)
        print("lost", first.lost, flush=True)
