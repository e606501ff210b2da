"""Completers: what the tab key offers of a launch file and of plugins, as bash hands its words over."""

from collections.abc import Callable

import pytest


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("run talk.yaml r", ["rate_hz:="]),
        ("run talk.yaml rate_hz := 5 --set nodes.talker.parameters.r", ["nodes.talker.parameters.rate_hz="]),
        ("check talk.yaml --set nodes.talker.parameters.f", ["nodes.talker.parameters.fail_at="]),
        ("check talk.yaml --set = nodes.listener.", ["nodes.listener.plugin="]),
        ("run talk.yaml rate_hz :=", []),
        ("plugins info tal", ["talker"]),
        ("replay run.mcap --plugin tal", ["talker"]),
        ("run --set nodes.", []),
        ("run missing.yaml r", []),
        ("run talk.yaml --profile nope --set nodes.", []),
    ],
)
@pytest.mark.usefixtures("project")
def test_launch_file_and_plugins_are_completed(words: str, expected: list[str], completed: Callable[[str], list[str]]):
    assert completed(words) == expected
