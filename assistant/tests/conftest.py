"""The fixtures of busflow's own tests, and the pages of the question sets."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from busflow_assistant import timeouts
from busflow_assistant.engine import Engine
from busflow_assistant.markdown import read_page

pytest_plugins = ("tests.conftest", "tests.cli.conftest", "tests.whole_files")

TESTS = Path(__file__).parent


@pytest.fixture(scope="session", autouse=True)
def unhurried_assistant() -> Iterator[None]:
    """Let the assistant wait for its pages however busy the machine is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(timeouts.VARIABLE, "reading=inf")
        patch.setattr(timeouts, "current", timeouts.Timeouts(reading=86_400))
        yield


@pytest.fixture(scope="session")
def lab1() -> Engine:
    """An engine of the first lab's page."""
    return Engine([read_page("lab1.md", (TESTS / "pages/lab1.md").read_text(encoding="utf-8"))])


@pytest.fixture(scope="session")
def ros2_lab() -> str:
    """A lab of ROS 2, as a browser's selection gives it: code without fences or indentation."""
    return (TESTS / "pages/ros2_lab1.txt").read_text(encoding="utf-8")
