"""A run with a lamp, in a process of its own, and a place for a run of several sessions."""

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.wire.conftest import Robot
from tests.wire.mirror.lamp import SERVER


@pytest.fixture
def room(robots: Callable[..., Robot]) -> Robot:
    return robots(SERVER, "room").ready()


@pytest.fixture
def directory() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as name:  # the path of a socket has to be short
        yield Path(name)
