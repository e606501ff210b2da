"""The fixtures of busflow's own tests, and the pages of the question sets."""

from pathlib import Path

import pytest

from busflow_assistant.engine import Engine
from busflow_assistant.markdown import read_page

pytest_plugins = ("tests.conftest", "tests.cli.conftest", "tests.whole_files")

TESTS = Path(__file__).parent


@pytest.fixture(scope="session")
def lab1() -> Engine:
    """An engine of the first lab's page."""
    return Engine([read_page("lab1.md", (TESTS / "pages/lab1.md").read_text(encoding="utf-8"))])


@pytest.fixture(scope="session")
def ros2_lab() -> str:
    """A lab of ROS 2, as a browser's selection gives it: code without fences or indentation."""
    return (TESTS / "pages/ros2_lab1.txt").read_text(encoding="utf-8")
