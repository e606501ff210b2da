"""How many messages leave the arrival buffer together: many small ones, and of the large ones each by itself."""

from collections import deque
from types import SimpleNamespace

import pytest

from busflow.wire.mirror.arrival_buffer import ArrivalBuffer, is_large
from busflow.wire.zenoh.keys import ATTACHMENT_BYTES
from busflow.wire.zenoh.sender import LARGE


class Raw(bytes):
    def to_bytes(self):
        return bytes(self)


class Ring(deque):
    """What Zenoh's ring hands over, as far as the buffer looks at it."""

    def try_recv(self):
        return self.popleft() if self else None


def sample(size, *, attachment=bytes(ATTACHMENT_BYTES)):
    return SimpleNamespace(payload=Raw(size), attachment=Raw(attachment))


@pytest.mark.parametrize("large", [sample(LARGE), sample(0, attachment=bytes(ATTACHMENT_BYTES + 1))])
def test_large_message_comes_last_of_those_taken(large):
    buffer = ArrivalBuffer(Ring([sample(1), large, sample(2), large]), 8, float("inf"), pytest.fail)
    buffer.put(sample(LARGE))
    batches = [buffer.take(8) for _ in range(4)]
    assert [len(batch) for batch in batches] == [1, 2, 2, 0]
    assert [[is_large(each) for each in batch] for batch in batches] == [[True], [False, True], [False, True], []]
