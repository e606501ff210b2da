"""The examples in docstrings of busflow_ui print what they show."""

import doctest
from importlib import import_module
from pathlib import Path

import pytest

UI = Path(__file__).parents[1]
WITH_EXAMPLES = [path for path in sorted(UI.glob("busflow_ui/**/*.py")) if ">>> " in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("path", WITH_EXAMPLES, ids=lambda path: path.name)
def test_examples_print_what_they_show(path: Path):
    found = doctest.testmod(import_module(".".join(path.relative_to(UI).with_suffix("").parts)))
    assert found.attempted > 0
    assert found.failed == 0
