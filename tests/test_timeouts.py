"""Limits of real time: the text that sets them, and how processes get them."""

import os
import subprocess
import sys

import pytest

from busflow.errors import InvalidInput
from busflow.timeouts import VARIABLE, Timeouts, stated


def test_text_sets_limits_and_keeps_the_others():
    assert stated("", Timeouts()) == stated(" , ", Timeouts()) == Timeouts()
    assert stated("grace=20, import_warning = inf", Timeouts()) == Timeouts(grace=20, import_warning=86_400)
    assert stated("grace=0,grace=1", Timeouts()).changed() == {"grace": 1.0}


def test_infinity_is_a_day_that_every_wait_takes():
    assert stated("departure=inf", Timeouts()).departure == 86_400


@pytest.mark.parametrize(
    ("text", "why", "fix"),
    [
        ("grce=1", "'grce'", "did you mean 'grace'?"),
        ("grace", "grace", "write grace=20"),
        ("grace=\x1b", r"'\x1b'", "write grace=20"),
        ("grace=-1", "'-1'", "write grace=20"),
        ("grace=nan", "'nan'", "write grace=20"),
    ],
)
def test_wrong_name_or_limit_is_refused(text, why, fix):
    with pytest.raises(InvalidInput) as caught:
        stated(text, Timeouts())
    problem = caught.value.problem
    assert (problem.code, problem.fix) == ("timeouts", fix)
    assert why in problem.message


def test_command_with_a_wrong_limit_ends_at_once():
    command = [sys.executable, "-m", "busflow", "plugins"]
    ran = subprocess.run(command, env={**os.environ, VARIABLE: "grace=soon"}, capture_output=True, text=True)
    assert (ran.returncode, ran.stdout) == (2, "")
    assert ran.stderr.startswith(f"error: {VARIABLE}: grace ")
    assert ran.stderr.count("\n") == 2
