"""Each command of ROS 2 has a row on the page, and each counterpart there is a command with these options."""

import re
import shlex
from pathlib import Path

import pytest

from busflow.cli import main

PAGE = Path(__file__).parents[2] / "docs/ros2-commands.md"
ROS2 = {
    "action": "echo find info list send_goal type",
    "bag": "burst convert info list play record reindex",
    "component": "list load standalone types unload",
    "daemon": "start status stop",
    "doctor": "",
    "interface": "list package packages proto show",
    "launch": "",
    "lifecycle": "get list nodes set",
    "multicast": "receive send",
    "node": "info list",
    "param": "delete describe dump get list load set",
    "pkg": "create executables list prefix xml",
    "run": "",
    "security": "",
    "service": "call echo find info list type",
    "test": "",
    "topic": "bw delay echo find hz info list pub type",
    "wtf": "",
}
"""The commands of `ros2` in the distribution of 2025, with their verbs."""
CODE = re.compile("`([^`]+)`")
ROWS = [
    [cell.strip() for cell in line.strip("|").split(" |")]
    for line in PAGE.read_text("utf-8").splitlines()
    if line.startswith("| ") and not line.startswith("| ROS 2 |")
]
COUNTERPARTS = sorted(
    {text for row in ROWS for cell in row[1:] for text in CODE.findall(cell) if text[:8] == "busflow "}
)


def test_every_command_of_ros2_has_a_row():
    asked = [text for row in ROWS for text in CODE.findall(row[0])]
    missing = [
        f"ros2 {command} {verb}".strip()
        for command, verbs in ROS2.items()
        for verb in verbs.split() or [""]
        if not any(text.split()[: 2 + bool(verb)] == ["ros2", command, *([verb] if verb else [])] for text in asked)
    ]
    assert missing == []


def test_command_without_counterpart_says_why():
    assert [row[0] for row in ROWS if not row[1] and not row[2]] == []


@pytest.mark.parametrize("text", COUNTERPARTS)
def test_counterpart_is_a_command_with_these_options(capsys, text):
    words = shlex.split(text.replace("…", ""))[1:]
    path = words[:2] if words[0] in ROS2 or words[0] in {"plugins", "tf"} else words[:1]
    if words[0] in {"run", "test", "doctor"}:
        path = words[:1]
    assert main([*path, "--help"]) == 0
    shown = capsys.readouterr().out
    assert f"Usage: busflow {' '.join(path)}" in shown
    for option in (each for each in words[len(path) :] if each.startswith("-")):
        assert re.search(rf"(^| ){re.escape(option)}\b", shown, re.MULTILINE), f"{option} is no option of it"


@pytest.mark.parametrize(
    "words",
    [words for command, verbs in ROS2.items() for words in [[command, verb] for verb in verbs.split()] or [[command]]],
    ids=" ".join,
)
def test_command_typed_unchanged_is_answered(capsys, words):
    """It is a command here, or an error names what to write."""
    code = main([*words, "--help"])
    out, err = capsys.readouterr()
    unchanged = code == 0 and f"Usage: busflow {' '.join(words)}" in out
    named = code == 2 and re.search(r"busflow (?!command)\w+", err.splitlines()[0])
    assert unchanged or named, err
