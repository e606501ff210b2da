"""Facts from elsewhere, as data in `tests/cases`; a case that does not apply says why under `skip`."""

import json
from functools import cache
from operator import itemgetter
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).parent / "cases"


@cache
def suite(name: str) -> Any:
    """Read a file of cases."""
    return json.loads((FOLDER / f"{name}.json").read_text("utf-8"))


def cases(name: str, *beginnings: str) -> list[dict[str, Any]]:
    """Return the cases of a file that apply: all, or those whose ids begin so, e.g. `range/`."""
    found = [case for case in suite(name)["cases"] if case["id"].startswith(beginnings or "") and "skip" not in case]
    assert found, f"{name} has no such cases: {beginnings}"
    return found


def each_case(name: str, *beginnings: str) -> pytest.MarkDecorator:
    """Run a test with each of these cases, as its argument `case`."""
    return pytest.mark.parametrize("case", cases(name, *beginnings), ids=itemgetter("id"))
