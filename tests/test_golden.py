"""Golden texts: a difference fails, `--update` writes them anew, and each section belongs to a test."""

import re
from pathlib import Path

import pytest

from tests.golden import HEADING, Golden, sections

ROOT = Path(__file__).parents[1]
PINNED = [
    file
    for folder in ("tests", "ui/tests", "assistant/tests")
    for file in sorted(ROOT.glob(f"{folder}/**/test_*.txt"))
    if file.with_suffix(".py").exists()
]


def test_a_difference_fails_until_it_is_updated(tmp_path: Path):
    file = tmp_path / "test_clock.txt"
    Golden(file, "test_b", update=True)("later", "end")
    Golden(file, "test_a", update=True)("at 12:01  \nin /home/x1", mask={r"\d\d:\d\d": "TIME", "/home/x1": "FOLDER"})
    assert file.read_text() == "=== test_a\nat TIME\nin FOLDER\n\n=== test_b: end\nlater\n"
    Golden(file, "test_b", update=False)("later", "end")
    with pytest.raises(pytest.fail.Exception, match="--update"):
        Golden(file, "test_b", update=False)("earlier", "end")
    with pytest.raises(pytest.fail.Exception, match="--update"):
        Golden(file, "test_c", update=False)("later")


def test_texts_without_a_name_are_numbered(tmp_path: Path):
    golden = Golden(tmp_path / "test_clock.txt", "test_a", update=True)
    for late in (1, 2):
        with golden.raises(ValueError):
            raise ValueError(f"{late} s late")
    assert sections(golden.file) == {"test_a": "1 s late", "test_a: 2": "2 s late"}


@pytest.mark.parametrize("file", PINNED, ids=lambda file: str(file.relative_to(ROOT)))
def test_each_section_belongs_to_a_test(file: Path):
    tests = set(re.findall(r"^ *(?:async )?def (test_\w+)", file.with_suffix(".py").read_text("utf-8"), re.MULTILINE))
    titles = HEADING.findall(file.read_text("utf-8"))
    assert len(titles) == len(sections(file)) > 0
    assert {re.split(r"[\[:]", title)[0] for title in titles} <= tests
