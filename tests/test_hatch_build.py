"""What is built describes busflow's own messages, so that the command line need not import them."""

import shutil
import subprocess
import sys
import tarfile
from pathlib import Path
from zipfile import ZipFile

import pytest

from busflow.errors import UnknownType
from busflow.interfaces.encoding.builtin_types import DATA, read

ROOT = Path(__file__).parents[1]
INSIDE = DATA.relative_to(ROOT).as_posix()
SOURCES = "busflow/msgs"


@pytest.fixture
def clone(tmp_path):
    """A copy of the project as a fresh clone is: without what a build has written."""
    copy = tmp_path / "clone"
    copy.mkdir()
    for name in ("pyproject.toml", "README.md", "LICENSE", "hatch_build.py", ".gitignore"):
        shutil.copy(ROOT / name, copy)
    shutil.copytree(ROOT / "busflow", copy / "busflow", ignore=shutil.ignore_patterns("__pycache__", DATA.name))
    return copy


def build(project: Path, kind: str) -> Path:
    """What pip asks of the build: `build_wheel`, `build_editable` or `build_sdist`."""
    code = f"from hatchling.build import {kind}; print({kind}('dist'))"
    done = subprocess.run([sys.executable, "-c", code], cwd=project, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return project / "dist" / done.stdout.split()[-1]


def unpacked(wheel: Path, to: Path) -> Path:
    with ZipFile(wheel) as archive:
        archive.extractall(to)  # noqa: S202  # it was built here
    return to


def test_wheel_and_clone_have_the_description(clone, tmp_path):
    assert not (clone / INSIDE).exists()
    installed = unpacked(build(clone, "build_wheel"), tmp_path / "installed")
    for place in (installed, clone):
        assert "sensor_msgs/msg/Imu" in read(place / INSIDE, place / SOURCES)["types"]
    assert [each.name for each in (clone / "dist").iterdir()] == ["busflow-0.1.0-py3-none-any.whl"]


def test_an_editable_install_writes_it_into_the_clone(clone):
    build(clone, "build_editable")
    assert "sensor_msgs/msg/Imu" in read(clone / INSIDE, clone / SOURCES)["types"]


@pytest.mark.long
def test_a_wheel_from_a_source_distribution_has_it(clone, tmp_path):
    build(clone, "build_wheel")
    with tarfile.open(build(clone, "build_sdist")) as sdist:
        assert not any(name.endswith(DATA.name) for name in sdist.getnames())
        sdist.extractall(tmp_path, filter="data")
    (source,) = tmp_path.glob("busflow-*")
    installed = unpacked(build(source, "build_wheel"), tmp_path / "installed")
    assert "sensor_msgs/msg/Imu" in read(installed / INSIDE, installed / SOURCES)["types"]


@pytest.mark.long
def test_wheel_from_read_only_clone_has_the_description(clone, tmp_path):
    (clone / INSIDE).with_suffix(".part").mkdir()  # nobody can write there, whoever runs the tests
    wheel = build(clone, "build_wheel")
    installed = unpacked(wheel, tmp_path / "installed")
    assert "sensor_msgs/msg/Imu" in read(installed / INSIDE, installed / SOURCES)["types"]
    assert not (clone / INSIDE).exists()
    assert list(wheel.parent.iterdir()) == [wheel]


def test_build_imports_no_other_dependency():
    heavy = ("pydantic", "numpy", "click", "yaml")
    code = f"import sys, hatch_build; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("[]\n", "")


def test_changed_messages_ask_for_a_new_install(clone):
    build(clone, "build_editable")
    changed = clone / SOURCES / "std_msgs/values.py"
    changed.write_text(changed.read_text("utf-8").replace("class Bool(", "class Boolean("), "utf-8")
    with pytest.raises(UnknownType) as refused:
        read(clone / INSIDE, clone / SOURCES)
    assert f"{clone / SOURCES}; pip install -e {clone}" in str(refused.value)
    build(clone, "build_editable")
    assert "std_msgs/msg/Boolean" in read(clone / INSIDE, clone / SOURCES)["types"]


def test_clone_never_installed_says_what_to_do(clone):
    command = [sys.executable, "-m", "busflow", "interface", "show", "std_msgs/msg/Bool"]
    done = subprocess.run(command, cwd=clone, capture_output=True, text=True)
    assert done.returncode != 0
    assert done.stdout == ""
    assert f"; pip install -e {clone}" in done.stderr
    build(clone, "build_editable")
    done = subprocess.run(command, cwd=clone, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "bool data" in done.stdout
