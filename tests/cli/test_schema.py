"""`busflow schema`: the keys of a launch file and the parameters of the plugins beside it."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Shell, append, edit

pytestmark = pytest.mark.usefixtures("project")


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


def test_schema_has_launch_keys_and_plugin_parameters(shell: Shell):
    assert {"nodes", "plugin", "rate_hz", "fail_at"} <= all_keys(json.loads(shell.text("schema talk.yaml")))
    edit("nodes:", "nodse:")
    assert "rate_hz" in all_keys(json.loads(shell.text("schema talk.yaml"))), "also of a file with mistakes"


def test_written_schema_comes_with_instructions(shell: Shell):
    assert shell("schema talk.yaml --write") == 0
    assert "nodes" in all_keys(json.loads(Path("talk.schema.json").read_text()))
    edit("name: talk", "# yaml-language-server: $schema=talk.schema.json\nname: talk")
    assert shell("schema talk.yaml --write") == 0
    append("raise ValueError('\x1b[31m')\n", "plugins/listener.py")
    assert shell("schema talk.yaml --write") == 0, "an unimportable plugin is reported and left out"
    assert "rate_hz" in all_keys(json.loads(Path("talk.schema.json").read_text()))
    assert shell("schema missing.yaml") == 2
