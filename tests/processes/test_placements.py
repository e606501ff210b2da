"""Where nodes run changes nothing of what topics carry: on virtual time all are in one process, whatever files say."""

import importlib.util
import sys
from collections import defaultdict
from pathlib import Path

import pytest

from busflow.bus.bus import BusObserver
from busflow.launchfile.load.load import load
from busflow.launchfile.model.placement import placed
from busflow.testing import harness, virtual_time
from busflow.testing.trace import content_hash

spec = importlib.util.spec_from_file_location("humanoid", Path(__file__).parents[2] / "benchmarks/humanoid.py")
humanoid = importlib.util.module_from_spec(spec)
sys.modules["humanoid"] = humanoid
spec.loader.exec_module(humanoid)


@virtual_time
async def carried(file):
    """By topic, the hashes of all messages of half a second."""
    found = defaultdict(list)
    lab = harness(file, seed=7)
    lab.graph.bus.observe(Taps(lab.graph.bus, found))
    async with lab:
        await lab.advance(0.5)
    return dict(found)


class Taps(BusObserver):
    def __init__(self, bus, found):
        self.bus, self.found = bus, found

    def topic_added(self, topic):
        if topic.name != "/rosout":
            hashes = self.found[topic.name]
            self.bus.tap(topic, lambda message: hashes.append(content_hash(message)))


@pytest.mark.parametrize("processes", [2, 4])
def test_humanoid_is_the_same_in_any_processes(tmp_path, processes):
    folder = tmp_path / "one"
    folder.mkdir()
    one = carried(humanoid.placed(folder, 1))
    file = humanoid.placed(tmp_path, processes)
    assert len(placed(load(file)).nodes) == processes
    assert carried(file) == one
    assert sum(map(len, one.values())) > 300
