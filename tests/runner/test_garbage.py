"""The collector leaves out what was there at the start of a run that is the whole program, and nothing after it."""

import asyncio
import gc
from contextlib import closing, contextmanager

import pytest

import busflow
from busflow import Node, timer
from busflow.runner.garbage import THRESHOLDS, StepwiseCollection, is_frozen

pytestmark = pytest.mark.usefixtures("unfrozen")


class Looking(Node):
    """Keeps what the collector is told while the node runs, and ends the run."""

    seen: list[tuple[tuple[int, int, int], bool]]

    async def run(self) -> None:
        self.seen = [(gc.get_threshold(), is_frozen())]


@contextmanager
def thresholds(*values):
    """What Python's own thresholds are, or what somebody has set."""
    before = gc.get_threshold()
    gc.set_threshold(*values)
    try:
        yield
    finally:
        gc.set_threshold(*before)


def test_whole_program_run_is_collected_in_steps():
    class Waiting(Looking):
        @timer(0.01)
        def tick(self) -> None:
            self.seen = [*getattr(self, "seen", []), (gc.get_threshold(), is_frozen())]
            if self.seen[-1][1]:
                raise KeyError("it has started")

        async def run(self) -> None:
            pass

    node = Waiting()
    with thresholds(700, 10, 10):
        assert busflow.run(node, inspect=False) == 1
        assert (gc.get_threshold(), gc.get_freeze_count()) == ((700, 10, 10), 0)
    assert node.seen[-1] == (THRESHOLDS, True)


def test_embedded_graph_leaves_the_collector_alone():
    async def main():
        node = Looking()
        async with busflow.launch(node) as graph:
            await graph.wait()
        return node.seen

    with thresholds(700, 10, 10):
        assert asyncio.run(main()) == [((700, 10, 10), False)]


@pytest.mark.parametrize("own", ["thresholds", "off", "frozen"])
def test_existing_collector_policy_stays(own):
    values = (123, 4, 5) if own == "thresholds" else (700, 10, 10)
    with thresholds(*values):
        if own == "off":
            gc.disable()
        elif own == "frozen":
            gc.freeze()
        try:
            with closing(StepwiseCollection()) as collection:
                collection.begin()
                assert (gc.get_threshold(), is_frozen()) == (values, own == "frozen")
                collection.unfreeze()
                assert is_frozen() is (own == "frozen")
            assert (gc.get_threshold(), is_frozen()) == (values, own == "frozen")
        finally:
            gc.enable()
            gc.unfreeze()


def test_replaced_node_can_be_collected_after_a_restart():
    class Ring:
        def __init__(self) -> None:
            self.me = self

        def __del__(self) -> None:
            gone.append(True)

    gone: list[bool] = []
    with thresholds(700, 10, 10), closing(StepwiseCollection()) as collection:
        ring = Ring()
        collection.begin()
        del ring
        gc.collect()
        assert gone == []
        collection.unfreeze()
        gc.collect()
        assert gone == [True]
