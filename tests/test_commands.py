"""The names that other distributions may use: all there, typed, and imported when they are used."""

import ast
from importlib import import_module
from pathlib import Path

import pytest

import busflow
from busflow import commands
from tests.new_interpreter import printed_by

STUBS = {name: Path(busflow.__file__).with_name(name) for name in ("__init__.pyi", "commands.pyi")}


@pytest.mark.parametrize("name", commands.__all__)
def test_every_name_is_there(name: str):
    assert getattr(commands, name).__doc__ or callable(getattr(commands, name))


@pytest.mark.parametrize(("module", "stub"), [(busflow, "__init__.pyi"), (commands, "commands.pyi")])
def test_type_checker_sees_the_same_names(module, stub: str):
    imports = [each for each in ast.parse(STUBS[stub].read_text("utf-8")).body if isinstance(each, ast.ImportFrom)]
    homes = {name.asname: (each.module or "", name.name) for each in imports for name in each.names if name.asname}
    assert sorted(homes) == module.__all__
    for name, (home, original) in homes.items():
        assert getattr(module, name) is getattr(import_module(home), original)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"'busflow\.commands' has no attribute 'nothing'"):
        _ = commands.nothing


def test_importing_them_joins_no_run():
    assert printed_by("import sys; from busflow.commands import joined; print('zenoh' in sys.modules)") == "False"
