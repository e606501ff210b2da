"""The public names: few, all there, and none hidden behind a module of the same name."""

import inspect
import pkgutil

import pytest

import busflow
from busflow import Node
from tests.new_interpreter import printed_by

MODULES = {module.name for module in pkgutil.iter_modules(busflow.__path__)}


@pytest.mark.parametrize("name", busflow.__all__)
def test_every_public_name_is_there(name):
    assert getattr(busflow, name) is not None


def test_no_public_name_is_also_a_module():
    """Importing the module would put it in the name's place; see docs/decisions/0001."""
    assert set(busflow.__all__) & MODULES == set()


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nothing"):
        _ = busflow.nothing


def test_node_has_at_most_sixteen_public_names():
    there = {name for name in dir(Node) if hasattr(Node, name)}  # and not a name of rclpy's, which says where it is
    names = {name for name in there if not name.startswith("__")} | set(Node.__annotations__)
    assert len({name for name in names if not name.startswith("_")}) <= 16
    assert {name for name in names if name.startswith("_")} == {"_runtime"}


def test_every_public_name_has_a_docstring():
    said = {name: inspect.getdoc(getattr(busflow, name)) for name in busflow.__all__}
    kinds = {name for name in said if inspect.isclass(getattr(busflow, name)) or callable(getattr(busflow, name))}
    assert {name for name in kinds if not said[name]} == set()


def test_importing_busflow_imports_nothing_else_of_weight():
    heavy = ("pydantic", "numpy", "asyncio", "rich", "typing")
    code = f"import sys, busflow; print([name for name in {heavy} if name in sys.modules])"
    assert printed_by(code) == "[]"
