"""The tests of `busflow dds` that need no run; those with one are in `tests/dds`."""

import pytest

from busflow.cli import main
from busflow.errors import ExitCode


@pytest.mark.parametrize(
    ("options", "code", "text"),
    [
        (["--domain", "233"], ExitCode.USAGE, "233 is not in the range 0<=x<=232"),
        ([], ExitCode.NOT_FOUND, "nothing is running"),
    ],
)
def test_bridge_that_cannot_open_says_why(capsys, options, code, text):
    assert main(["dds", *options]) == code
    assert text in capsys.readouterr().err
