"""rclpy's names on a node: each says what to write instead, and is in nobody's way."""

from pathlib import Path

import pytest

from busflow import Node
from busflow.node.node import _RCLPY

PAGE = (Path(__file__).parents[2] / "docs/coming-from-rclpy.md").read_text(encoding="utf-8").replace("`", "")
NAMES = list(_RCLPY)


class Camera(Node):
    """A node without names of its own."""


@pytest.mark.parametrize("name", NAMES)
def test_each_name_says_what_the_page_says(name, golden):
    with golden.raises(AttributeError) as told:
        getattr(Camera(), name)
    assert str(told.value).partition("here it is ")[2] in PAGE


def test_what_robots_ask_first_is_among_them():
    assert {"get_logger", "declare_parameter", "get_parameter", "get_clock", "create_rate"} <= set(NAMES)


def test_node_may_have_such_a_name_itself(golden):
    class Named(Node):
        def get_name(self) -> str:
            return "mine"

    assert Named().get_name() == "mine"
    assert not hasattr(Camera(), "get_logger")
    with golden.raises(AttributeError):
        getattr(Camera(), "get_loger")  # noqa: B009  # type checkers know it, too


def test_dir_lists_an_rclpy_name_only_if_defined():
    class Named(Node):
        def get_name(self) -> str:
            return "mine"

    assert set(dir(Camera())) & set(NAMES) == set()
    assert set(dir(Named())) & set(NAMES) == {"get_name"}
    assert {"create_publisher", "parameters", "clock"} <= set(dir(Camera()))
