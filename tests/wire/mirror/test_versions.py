"""Processes of a run learn each other's version: real sessions, each with a graph of its own."""

import asyncio
import os
import time

import pytest

from busflow import Node, launch
from busflow.wire.mirror.membership import Membership
from busflow.wire.zenoh.run_directory import RunCard
from tests.wire.mirror.processes import until

pytestmark = pytest.mark.asyncio


def member(directory, name, version):
    """A graph of one process that shows this version, and the versions that it has seen."""
    graph, seen = launch(type(name.title(), (Node,), {})), {}
    card = RunCard("robot", os.getpid(), time.time_ns(), "", version)
    earlier = [] if name == "main" else ["main.sock"]
    own = {"process": name, "socket": f"{name}.sock", "earlier": earlier}
    graph.attach(Membership(graph, directory, card, on_version=seen.__setitem__, **own))
    return graph, seen


async def test_processes_see_each_others_versions(directory):
    (first, seen_by_first), (second, seen_by_second) = (
        member(directory, name, version) for name, version in (("main", "0.1.0"), ("arm", "0.2.0.dev1+g1a2b3c"))
    )
    await asyncio.gather(first.start(), second.start())
    everything = {"main": "0.1.0", "arm": "0.2.0.dev1+g1a2b3c"}
    await until(lambda: seen_by_first == seen_by_second == everything)
    await second.stop()
    await first.stop()
