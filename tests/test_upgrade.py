"""Projects that were written for a released version work with this core: launch files, plugins, examples, commands.

`tests/cases/releases/0.1.0` has the launch files, plugins and examples of that version as they were, the names of its
public modules, and the wheels of `busflow-ui` and `busflow-assistant`. The tests of its examples are collected where
they lie. `ui/tests/page_server` and `assistant/tests` have a `test_upgrade.py` too, which starts the old distribution
beside a run of this core.
`.ci/released` compares the types that all of them use. Recordings are in `test_compatibility.py`.

Keep all of it as it is until 0.2.0, whose release puts its own files in place of these. Where a change of the core
fails here, mend the change and not the data, e.g. by a lazy alias for a name that has moved.
"""

import ast
import json
from importlib import import_module
from pathlib import Path
from zipfile import ZipFile

import pytest
from packaging.version import Version

import busflow
from busflow.cli import main
from busflow.testing import harness, virtual_time
from tests.released import RELEASES, wheel

OF_THE_ASSISTANT = "textbook.yaml"
"""The launch file whose nodes only `busflow-assistant` has, whose tests run it."""
SLOW = ("humanoid", "lab_balance", "lab_fall")
"""Launch files of 31 joints, or of physics, whose minute takes seconds."""
CONFIGS = [file for each in RELEASES for file in sorted(each.glob("configs/*.yaml")) if file.name != OF_THE_ASSISTANT]
EXAMPLES = [file for each in RELEASES for file in sorted(each.glob("examples/*/*.yaml"))]


def named(file: Path) -> str:
    return f"{next(each.name for each in RELEASES if file.is_relative_to(each))}: {file.name}"


def test_releases_are_of_this_line():
    lines = {Version(each.name).release[:2] for each in RELEASES}
    assert lines == {Version(busflow.__version__).release[:2]}


@pytest.mark.parametrize("file", [*CONFIGS, *EXAMPLES], ids=named)
def test_check_finds_nothing_even_when_strict(file: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["check", str(file), "--strict"]) == 0
    assert capsys.readouterr().out == "no problems\n"


@pytest.mark.parametrize("file", CONFIGS, ids=named)
@virtual_time
async def test_launch_file_runs_and_loses_nothing(file: Path):
    async with harness(file) as lab:
        await lab.advance(1 if file.stem.startswith(SLOW) else 20)
    report = lab.graph.report()
    assert {node.state for node in report.nodes} == {"stopped"}
    assert sum(topic.published for topic in report.topics) > 0
    assert report.dropped == 0
    assert {record.level for record in lab.log} <= {"info"}


@pytest.mark.filterwarnings("ignore:.*is deprecated and gone in:DeprecationWarning")
@pytest.mark.parametrize("release", RELEASES, ids=lambda release: release.name)
def test_public_names_are_there(release: Path):
    modules: dict[str, list[str]] = json.loads((release / "names.json").read_text("utf-8"))
    gone = {f"{module}.{name}" for module, names in modules.items() for name in names if not has(module, name)}
    assert gone == set()


def has(module: str, name: str) -> bool:
    return hasattr(import_module(module), name)


def missing(sources: ZipFile) -> list[str]:
    """Names of busflow that the modules of a wheel import, also for annotations alone, and that are not there."""
    found: list[str] = []
    for path in sources.namelist():
        nodes = ast.walk(ast.parse(sources.read(path))) if path.endswith(".py") else ()
        for node in nodes:
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "busflow":
                names = [each.name for each in node.names if not has(node.module or "", each.name)]
                found += [f"{path}: {node.module}.{name}" for name in names]
    return found


@pytest.mark.filterwarnings("ignore:.*is deprecated and gone in:DeprecationWarning")
@pytest.mark.parametrize("distribution", ["busflow_ui", "busflow_assistant"])
@pytest.mark.parametrize("release", RELEASES, ids=lambda release: release.name)
def test_names_that_a_released_distribution_imports_are_there(release: Path, distribution: str):
    with wheel(release, distribution) as sources:
        assert missing(sources) == []
