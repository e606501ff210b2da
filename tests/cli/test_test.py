"""`busflow test`: runs a launch file on simulated time and checks its expectations."""

import json
from pathlib import Path

import pytest

from busflow.cli import main

pytestmark = pytest.mark.usefixtures("project")
Captured = pytest.CaptureFixture[str]


def expect(section: str) -> None:
    with Path("talk.yaml").open("a") as file:
        file.write(f"expect: {section}\n")


def test_file_without_expectations_passes_without_failures(capsys: Captured):
    assert main(["test", "talk.yaml", "--for", "1s"]) == 0
    assert "no node failed; the file has no `expect:` section" in capsys.readouterr().out


def test_unmet_expectation_has_exit_code_1(capsys: Captured):
    expect("{topics: {/numbers: {rate_hz: [1000, 2000]}}}")
    assert main(["test", "talk.yaml", "--for", "1s", "--seeds", "2", "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert (answer["ok"], answer["seeds"], answer["for_s"]) == (False, [0, 1], 1.0)
    assert answer["problems"]


def test_unknown_topic_is_refused_before_running(capsys: Captured):
    expect("{topics: {/nmbers: {max_dropped: 0}}}")
    assert main(["test", "talk.yaml", "--for", "1s"]) == 2
    assert "/nmbers" in capsys.readouterr().err
