"""The tests of `busflow dds` that need no run; those with one are in `tests/dds`."""

import pytest

from tests.cli.conftest import Shell


@pytest.mark.usefixtures("place")
def test_bridge_that_cannot_open_says_why(shell: Shell):
    assert shell("dds --domain 233") == 2
    assert shell("dds") == 4
