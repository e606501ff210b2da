"""Projects that were written for a released version work with this core: launch files, plugins, examples, commands.

`tests/cases/releases/0.1.0` has the launch files, plugins and examples of that version as they were, and the wheels of
`busflow-ui` and `busflow-assistant`. The tests of its examples are collected where they lie. `ui/tests/page_server` and
`assistant/tests` have a `test_upgrade.py` too, which starts the old distribution beside a run of this core.
`.ci/released` compares the types that all of them use. Recordings are in `test_compatibility.py`.

Keep all of it as it is until 0.2.0, whose release puts its own files in place of these. Where a change of the core
fails here, mend the change and not the data, e.g. by a lazy alias for a name that has moved.
"""

import ast
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


def missing(sources: ZipFile) -> list[str]:
    """Names of busflow that the modules of a wheel import, also for annotations alone, and that are not there."""
    found: list[str] = []
    for path in sources.namelist():
        nodes = ast.walk(ast.parse(sources.read(path))) if path.endswith(".py") else ()
        for node in nodes:
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "busflow":
                module = import_module(node.module or "")
                found += [f"{path}: {node.module}.{each.name}" for each in node.names if not hasattr(module, each.name)]
    return found


@pytest.mark.filterwarnings("ignore:.*is deprecated and gone in:DeprecationWarning")
@pytest.mark.parametrize("distribution", ["busflow_ui", "busflow_assistant"])
@pytest.mark.parametrize("release", RELEASES, ids=lambda release: release.name)
def test_names_that_a_released_distribution_imports_are_there(release: Path, distribution: str):
    with wheel(release, distribution) as sources:
        assert missing(sources) == []
