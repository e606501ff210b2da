"""A thousand seeds of the lab: what it expects holds under each of them."""

from pathlib import Path

import pytest

from busflow.launchfile.load.load import load
from busflow.testing.expectations import Trials

LAB = Path(__file__).parents[2] / "configs/lab1.yaml"
BLOCK = 100


@pytest.mark.parametrize("first", range(0, 1000, BLOCK))
def test_lab_expectations_hold_under_a_thousand_seeds(first):
    trials = Trials(load(LAB), 2.0)
    trials.run(range(first, first + BLOCK))
    assert trials.problems() == []
    assert len(trials.seeds) == BLOCK
