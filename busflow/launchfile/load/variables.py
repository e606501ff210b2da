"""Variables of the environment, and words of a command, as a launch file states them: texts, whatever YAML has read."""

from __future__ import annotations

from collections.abc import Iterable

from busflow.launchfile.yaml.value import Value
from busflow.validation.faults import shown


def variables(env: Value) -> dict[str, str]:
    """Return the environment variables that an `env` section states, all as texts."""
    return {name: _text(each.content) for name, each in env.members.items()}


def texts(words: Iterable[object]) -> tuple[str, ...]:
    """Return the words of a command, all as texts.

    >>> texts(["camera", "--rate", 30, "--crop", True])
    ('camera', '--rate', '30', '--crop', 'true')
    """
    return tuple(map(_text, words))


def _text(value: object) -> str:
    return value if isinstance(value, str) else shown(value)
