"""Numbers on the command line: within a range, which NaN never is."""

import click
import pytest

from busflow.cli.options.number import Number


@pytest.mark.parametrize(
    ("text", "why"), [("nan", "nan is not a number"), ("-1", "is not in the range"), ("x", "not a valid float")]
)
def test_what_is_in_no_range_is_refused(text: str, why: str):
    with pytest.raises(click.BadParameter, match=why):
        Number(min=0).convert(text, None, None)
    assert Number(min=0).convert("0.5", None, None) == 0.5
