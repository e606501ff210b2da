"""The examples in docstrings print what they show."""

import doctest
from importlib import import_module
from pathlib import Path

import pytest

from tests.test_structure import ROOT, name

FILES = [path for part in ("busflow", "plugins", "benchmarks") for path in sorted(ROOT.glob(f"{part}/**/*.py"))]
WITH_EXAMPLES = [path for path in FILES if ">>> " in path.read_text(encoding="utf-8")]


def test_the_files_with_examples_are_found():
    assert ROOT / "busflow/text.py" in WITH_EXAMPLES


@pytest.mark.parametrize("path", WITH_EXAMPLES, ids=name)
def test_examples_print_what_they_show(path: Path):
    found = doctest.testmod(import_module(".".join(path.relative_to(ROOT).with_suffix("").parts)))
    assert found.attempted > 0
    assert found.failed == 0
