"""The page on licences has every distribution that the project asks for, with the licence that its metadata states."""

import re
import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from itertools import chain
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[1]
PAGE = (PROJECT / "docs/licences.md").read_text("utf-8")
ROWS = dict(re.findall(r"^\| ([\w-]+) \| ([^|]+) \| [^|]+ \|$", PAGE, re.MULTILINE))
LICENCES = {name: licence for name, licence in ROWS.items() if name != "distribution"}
OF_CLASSIFIERS = {
    "License :: OSI Approved :: MIT License": "MIT",
    "License :: OSI Approved :: Apache Software License": "Apache-2.0",
    "License :: OSI Approved :: BSD License": "BSD",
    "License :: OSI Approved :: MIT No Attribution License (MIT-0)": "MIT-0",
    "License :: OSI Approved :: Eclipse Public License 2.0 (EPL-2.0)": "EPL-2.0",
    "License :: OSI Approved :: Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
}
"""What metadata without a licence expression says."""
OWN = {"busflow", "busflow-ui", "busflow-assistant"}


def asked_for() -> set[str]:
    """The distributions that the three projects name, but for what busflow is measured beside."""
    found: set[str] = set()
    for folder in (".", "ui", "assistant"):
        if not (file := PROJECT / folder / "pyproject.toml").is_file():  # in a source distribution
            continue
        whole = tomllib.loads(file.read_text("utf-8"))
        groups = {name: group for name, group in whole.get("dependency-groups", {}).items() if name != "bench"}
        extras = whole["project"]["optional-dependencies"]
        for each in chain(whole["project"]["dependencies"], *extras.values(), *groups.values()):
            found.add(re.match(r"[\w.-]+", each)[0])
    return {name.lower() for name in found - OWN}


def test_page_has_what_the_projects_ask_for():
    assert asked_for() <= {name.lower() for name in LICENCES}


def test_notice_has_the_origin_of_every_message_package():
    notice = (PROJECT / "NOTICE").read_text("utf-8")
    packages = {path.stem for path in (PROJECT / "busflow/msgs").iterdir() if not path.name.startswith("_")}
    assert len(packages) > 15
    assert {name for name in packages if not re.search(rf"\b{name}\b", notice)} == set()


@pytest.mark.long  # not slow, but for the versions of .ci/locked.txt: a new one may word its licence anew
@pytest.mark.parametrize("name", LICENCES)
def test_licence_is_that_of_the_metadata(name: str):
    try:
        found = metadata(name)
    except PackageNotFoundError:
        pytest.skip(f"{name} is not installed here; it is where .ci/locked.txt is")
    stated = LICENCES[name].strip()
    if expression := found.get("License-Expression"):
        assert stated == expression
        return
    classifiers = {OF_CLASSIFIERS[each] for each in found.get_all("Classifier", []) if each in OF_CLASSIFIERS}
    words = classifiers or {found.get("License", "")}
    assert all(word in stated for word in words), (stated, words)
    assert words - {""}
