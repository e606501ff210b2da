"""Tests of `syntax.py`, `misplaced.py` and `key_faults.py`: each launch file of `mistakes.txt` and its whole report."""

import re
from pathlib import Path

import pytest

from busflow.launchfile.load.load import examine

GALLERY = Path(__file__).with_name("mistakes.txt").read_text().split("\n=== ")[1:]


def titled(entry: str) -> str:
    return entry.partition("\n")[0]


@pytest.mark.parametrize("entry", GALLERY, ids=titled)
def test_report_of_each_mistake_is_as_shown(entry: str, folder):
    _, *parts = re.split(r"^--- (.+)\n", entry, flags=re.MULTILINE)
    files = dict(zip(parts[::2], parts[1::2], strict=True))
    report = files.pop("report").strip("\n")
    for name, text in files.items():
        folder.write(text, name)
    _, problems = examine("lab1.yaml", environment={})
    assert "\n".join(problem.render() for problem in problems) == report


def test_gallery_has_each_mistake_once():
    titles = [titled(entry) for entry in GALLERY]
    assert len(titles) == len(set(titles)) >= 50
