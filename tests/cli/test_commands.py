"""`busflow.cli.commands`, where 0.1.0 had the names of `busflow.commands`."""

import pytest

from busflow import commands
from busflow.cli import commands as former


@pytest.mark.parametrize(("old", "name"), [("Peer", "Peer"), ("joined", "joined"), ("tell", "print_message")])
def test_former_place_is_deprecated(old: str, name: str):
    with pytest.warns(DeprecationWarning, match="gone in busflow 0.2: write busflow.commands") as found:
        assert getattr(former, old) is getattr(commands, name)
    assert found[0].filename == __file__
