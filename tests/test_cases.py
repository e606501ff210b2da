"""Cases from elsewhere in `tests/cases`: a test reads each of them, or it gives the reason why it does not apply."""

import ast
import re
from pathlib import Path

import pytest

from tests.vectors import FOLDER, suite

TESTS = [path.read_text("utf-8") for path in Path(__file__).parent.rglob("test_*.py")]
READS = [ast.literal_eval(f"({found},)") for text in TESTS for found in re.findall(r"cases?\((\"[^)]*)\)", text)]


@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("[a-o]_*.json")))
def test_each_case_is_read_or_skipped(name: str):
    found = [case["id"] for case in suite(name)["cases"]]
    assert len(set(found)) == len(found)
    assert all(case.get("skip", ".").endswith(".") for case in suite(name)["cases"])
    read = tuple(each for suite_, *chosen in READS if suite_ == name for each in chosen or [""])
    left = [case["id"] for case in suite(name)["cases"] if "skip" not in case and not case["id"].startswith(read)]
    assert [each for each in left if not any(each in text for text in TESTS)] == []
