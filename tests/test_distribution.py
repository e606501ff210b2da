"""What the distributions of busflow hold: its sources and tests, nothing of the others, and every documented name."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
from hatchling.builders.sdist import SdistBuilder

PROJECT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def names(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    """The files of the source distribution of this project, with folders `ui` and `assistant` beside it."""
    project = tmp_path_factory.mktemp("project")
    for part in ("busflow", "tests", "docs"):
        shutil.copytree(PROJECT / part, project / part, ignore=shutil.ignore_patterns("__pycache__", "cases"))
    for file in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(PROJECT / file, project)
    for other in ("ui/busflow_ui", "assistant/busflow_assistant"):
        (project / other).mkdir(parents=True)
        (project / other / "__init__.py").write_text("")
    (built,) = SdistBuilder(str(project)).build(directory=str(project / "dist"))
    with tarfile.open(built) as archive:
        return {name.partition("/")[2] for name in archive.getnames()}


def test_source_distribution_holds_tests_and_build_files(names: set[str]):
    assert {"pyproject.toml", "README.md", "LICENSE", "busflow/py.typed", "tests/conftest.py"} <= names


def test_it_holds_nothing_of_other_distributions(names: set[str]):
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
    for file in ("pyproject.toml", "README.md", "LICENSE", "hatch_build.py"):
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
