"""The names that commands of other distributions may use: all there, typed, and imported when they are used."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from busflow.cli import commands


@pytest.mark.parametrize("name", commands.__all__)
def test_every_name_is_there(name: str):
    assert getattr(commands, name).__doc__ or callable(getattr(commands, name))


def test_type_checker_sees_the_same_names():
    module = ast.parse(Path(commands.__file__).read_text("utf-8"))
    guarded = next(each for each in module.body if isinstance(each, ast.If))
    imports = [each for each in guarded.body if isinstance(each, ast.ImportFrom)]
    homes = {name.asname or name.name: (each.module or "", name.name) for each in imports for name in each.names}
    assert homes.keys() == set(commands.__all__)
    for name, (home, original) in homes.items():
        assert getattr(commands, name) is getattr(sys.modules[home], original)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nothing"):
        _ = commands.nothing


def test_importing_them_joins_no_run():
    code = "import sys; from busflow.cli import commands; commands.joined; print('zenoh' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "False\n"
