"""`busflow test`: runs a launch file on simulated time and checks its expectations."""

import pytest

from tests.cli.conftest import Shell, append

pytestmark = pytest.mark.usefixtures("project")


def test_file_without_expectations_passes_without_failures(shell: Shell):
    assert shell("test talk.yaml --for 1s") == 0
    assert shell("test talk.yaml --seeds 2 --seed 5") == 2


def test_unmet_expectation_has_exit_code_1(shell: Shell):
    append("expect: {topics: {/numbers: {rate_hz: [1000, 2000]}}}\n")
    assert shell("test talk.yaml --for 1s --seeds 2") == 1
    answer = shell.data("test talk.yaml --for 1s --seeds 2", code=1)
    assert (answer["ok"], answer["seeds"], answer["for_s"]) == (False, [0, 1], 1.0)
    assert answer["problems"]


def test_unknown_topic_is_refused_before_running(shell: Shell):
    append("expect: {topics: {/nmbers: {max_dropped: 0}}}\n")
    assert shell("test talk.yaml --for 1s") == 2
