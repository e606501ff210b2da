"""Four hundred seeds of the lab: what it expects holds under each of them."""

from pathlib import Path

import pytest

from busflow.launchfile.load.load import load
from busflow.testing.expectations import Trials

LAB = Path(__file__).parents[2] / "configs/lab1.yaml"
BLOCK = 100


@pytest.mark.parametrize(
    "first", [0, *(pytest.param(first, marks=pytest.mark.long) for first in range(BLOCK, 4 * BLOCK, BLOCK))]
)
def test_lab_keeps_its_expectations_under_every_seed(first):
    trials = Trials(load(LAB), 2.0)
    trials.run(range(first, first + BLOCK))
    assert trials.problems() == []
    assert len(trials.seeds) == BLOCK
