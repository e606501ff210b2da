"""`busflow schema`: the keys of a launch file and the parameters of the plugins beside it."""

import json
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main

pytestmark = pytest.mark.usefixtures("project")

Captured = pytest.CaptureFixture[str]


def all_keys(schema: Any) -> set[str]:
    """Every property that the schema names anywhere."""
    found: set[str] = set()
    if isinstance(schema, dict):
        properties = schema.get("properties")
        found |= set(properties) if isinstance(properties, dict) else set()
        found |= {key for each in schema.values() for key in all_keys(each)}
    if isinstance(schema, list):
        found |= {key for each in schema for key in all_keys(each)}
    return found


def test_schema_has_launch_keys_and_plugin_parameters(capsys: Captured):
    assert main(["schema", "talk.yaml"]) == 0
    assert {"nodes", "plugin", "rate_hz", "fail_at"} <= all_keys(json.loads(capsys.readouterr().out))


def test_written_schema_comes_with_instructions(capsys: Captured):
    assert main(["schema", "talk.yaml", "--write"]) == 0
    captured = capsys.readouterr()
    assert captured.out == "Wrote talk.schema.json\n"
    assert "# yaml-language-server: $schema=talk.schema.json" in captured.err
    assert "nodes" in all_keys(json.loads(Path("talk.schema.json").read_text()))
    text = Path("talk.yaml").read_text()
    Path("talk.yaml").write_text(f"# yaml-language-server: $schema=talk.schema.json\n{text}")
    assert main(["schema", "talk.yaml", "--write"]) == 0
    assert capsys.readouterr().err == ""


def test_unimportable_plugin_is_reported_and_left_out(capsys: Captured):
    with Path("plugins/listener.py").open("a") as file:
        file.write("raise ValueError('\x1b[31m')\n")
    assert main(["schema", "talk.yaml"]) == 0
    captured = capsys.readouterr()
    assert "rate_hz" in all_keys(json.loads(captured.out))
    assert captured.err.startswith(
        "warning: the schema lacks the parameters of listener\nplugins/listener.py:12:1: error:"
    )
    assert "\x1b" not in captured.err


def test_a_file_with_mistakes_still_gets_its_schema(capsys: Captured):
    Path("talk.yaml").write_text(Path("talk.yaml").read_text().replace("nodes:", "nodse:"))
    assert main(["schema", "talk.yaml"]) == 0
    assert "rate_hz" in all_keys(json.loads(capsys.readouterr().out))


def test_unreadable_file_is_reported(capsys: Captured):
    assert main(["schema", "missing.yaml"]) == 2
    assert "cannot read missing.yaml" in capsys.readouterr().err
