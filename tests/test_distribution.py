"""What the distributions of busflow hold: its sources and tests, nothing of the others, and every documented name."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path

import pytest
from hatchling.builders.sdist import SdistBuilder
from packaging.specifiers import SpecifierSet

from busflow import __version__
from busflow.errors import how_to_install

PROJECT = Path(__file__).parents[1]
BUILD_FILES = ("pyproject.toml", "README.md", "LICENSE", "NOTICE", "hatch_build.py")
FILES = f"https://github.com/busflow/busflow/blob/v{__version__}/"


@pytest.fixture(scope="module")
def names(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The files of the source distribution of this project, with folders `ui` and `assistant` beside it.

    Each has the text of its metadata, the others none.
    """
    project = tmp_path_factory.mktemp("project")
    for part in ("busflow", "tests", "docs"):
        shutil.copytree(PROJECT / part, project / part, ignore=shutil.ignore_patterns("__pycache__", "cases"))
    for file in BUILD_FILES:
        shutil.copy(PROJECT / file, project)
    for other in ("ui/busflow_ui", "assistant/busflow_assistant"):
        (project / other).mkdir(parents=True)
        (project / other / "__init__.py").write_text("")
    (built,) = SdistBuilder(str(project)).build(directory=str(project / "dist"))
    with tarfile.open(built) as archive:
        return {each.name.partition("/")[2]: _text(archive, each) for each in archive.getmembers()}


def _text(archive: tarfile.TarFile, member: tarfile.TarInfo) -> str:
    file = archive.extractfile(member) if member.name.endswith("PKG-INFO") else None
    return file.read().decode() if file else ""


def test_source_distribution_holds_tests_and_build_files(names: dict[str, str]):
    assert {*BUILD_FILES, "busflow/py.typed", "tests/conftest.py"} <= names.keys()


def test_links_of_its_description_lead_into_the_project(names: dict[str, str]):
    """On a package index README.md stands alone."""
    targets = re.findall(r"\]\(([^)]+)\)", names["PKG-INFO"])
    inside = [each.removeprefix(FILES) for each in targets if each.startswith(FILES)]
    assert len(inside) > 20
    assert [each for each in inside if not (PROJECT / each.partition("#")[0]).exists()] == []
    assert [each for each in targets if not each.startswith("https://")] == []


def test_version_stands_in_one_place(names: dict[str, str]):
    assert f"\nVersion: {__version__}\n" in names["PKG-INFO"]
    assert "version" not in tomllib.loads((PROJECT / "pyproject.toml").read_text("utf-8"))["project"]


@pytest.mark.parametrize("other", ["ui", "assistant"])
def test_other_distributions_take_this_version(other: str):
    project = tomllib.loads((PROJECT / other / "pyproject.toml").read_text("utf-8"))["project"]
    (busflow,) = [SpecifierSet(each[7:]) for each in project["dependencies"] if each.startswith("busflow")]
    assert __version__ in busflow
    licence = PROJECT / other / "LICENSE"
    assert not licence.is_symlink()  # pip refuses a source distribution whose link leads out of it
    assert licence.read_bytes() == (PROJECT / "LICENSE").read_bytes()


def test_install_commands_change_in_one_table(monkeypatch: pytest.MonkeyPatch):
    """Once the distributions are published, only this table is emptied."""
    monkeypatch.setattr("busflow.errors.IN_A_CLONE", {})
    assert how_to_install("busflow[top]", "busflow-ui") == "pip install 'busflow[top]' busflow-ui"
    sources = [path for part in ("busflow", "ui/busflow_ui") for path in (PROJECT / part).rglob("*.py")]
    own = [path.name for path in sources if re.search(r"pip install ['\".-]", path.read_text("utf-8"))]
    assert sorted(own) == ["builtin_types.py", "errors.py"]  # of the first, a clone that was never installed


def test_it_holds_nothing_of_other_distributions(names: dict[str, str]):
    assert [name for name in names if name.startswith(("ui", "assistant"))] == []


def documented_imports() -> set[str]:
    """Each import of busflow in a page of the docs, as one line: `from busflow.testing import harness`."""
    pages = [PROJECT / "README.md", *PROJECT.glob("docs/**/*.md")]
    found = set()
    for page in pages:
        for code in re.findall(r"^```python.*?\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
            for line in re.findall(r"^ *from busflow[\w.]* import (?:\([^)]*\)|.*)$", code, re.MULTILINE):
                (statement,) = ast.parse(line.strip()).body
                assert isinstance(statement, ast.ImportFrom)
                found |= {f"from {statement.module} import {name.name}" for name in statement.names}
    return found


@pytest.mark.long
def test_every_documented_name_is_in_an_installed_wheel(tmp_path: Path):
    imports = documented_imports() | {
        "from busflow.errors import BusflowError",
        "from busflow.recording.bag import Bag",
        "from busflow.recording.player import Player",
        "from busflow.testing.trace import Trace",
        *(f"from busflow.msgs import {path.stem}" for path in PROJECT.glob("busflow/msgs/[a-z]*")),
        "from busflow import *",
        "from busflow.testing import *",
    }
    assert len(imports) > 50
    project, installed = tmp_path / "project", tmp_path / "installed"
    shutil.copytree(PROJECT / "busflow", project / "busflow", ignore=shutil.ignore_patterns("__pycache__"))
    for file in BUILD_FILES:
        shutil.copy(PROJECT / file, project)
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(tmp_path / "dist")]
    subprocess.run(build, check=True, timeout=120, cwd=project, capture_output=True)
    (wheel,) = map(str, (tmp_path / "dist").glob("*.whl"))
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
        "--target",
        str(installed),
        wheel,
    ]
    subprocess.run(pip, check=True, timeout=120, env={**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1"})
    program = "\n".join([*sorted(imports), "import busflow", "print(busflow.__file__)"])
    run = subprocess.run(
        [sys.executable, "-P", "-c", program],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (run.stdout.strip(), run.stderr) == (str(installed / "busflow/__init__.py"), "")
