"""What a source distribution of busflow holds: all that its wheel and its tests need, and nothing of busflow-ui."""

import shutil
import tarfile
from pathlib import Path

import pytest
from hatchling.builders.sdist import SdistBuilder

PROJECT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def names(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    """The files of the source distribution of this project, with a folder `ui` beside it."""
    project = tmp_path_factory.mktemp("project")
    for part in ("busflow", "tests", "docs"):
        shutil.copytree(PROJECT / part, project / part, ignore=shutil.ignore_patterns("__pycache__", "cases"))
    for file in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(PROJECT / file, project)
    (project / "ui/busflow_ui").mkdir(parents=True)
    (project / "ui/busflow_ui/__init__.py").write_text("")
    (built,) = SdistBuilder(str(project)).build(directory=str(project / "dist"))
    with tarfile.open(built) as archive:
        return {name.partition("/")[2] for name in archive.getnames()}


def test_it_holds_what_its_wheel_and_its_tests_need(names: set[str]):
    assert {"pyproject.toml", "README.md", "LICENSE", "busflow/py.typed", "tests/conftest.py"} <= names


def test_it_holds_nothing_of_busflow_ui(names: set[str]):
    assert [name for name in names if name.startswith("ui")] == []
