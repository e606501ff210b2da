"""Numbers on the command line: within a range, which NaN never is."""

import click
import pytest

from busflow.cli.options.number import Number
from tests.golden import Golden


@pytest.mark.parametrize("text", ["nan", "-1", "x"])
def test_number_outside_of_every_range_is_refused(text: str, golden: Golden):
    with golden.raises(click.BadParameter):
        Number(min=0).convert(text, None, None)
    assert Number(min=0).convert("0.5", None, None) == 0.5
