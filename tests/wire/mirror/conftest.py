"""A run with a lamp, in a process of its own, and a place for a run of several sessions."""

from collections.abc import Callable

import pytest

from tests.wire.conftest import Robot


@pytest.fixture
def room(robots: Callable[..., Robot]) -> Robot:
    return robots("lamp.py", "room").ready()
