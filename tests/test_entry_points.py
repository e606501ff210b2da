"""Entry points are found wherever the path holds metadata, and asked for only there."""

import importlib.metadata  # noqa: F401  # below, the path has no standard library to import it from
import sys
import zipfile
from importlib.machinery import PathFinder
from pathlib import Path

import pytest

from busflow.entry_points import entry_points, source_of

METADATA = {
    "lab-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: lab\nVersion: 1.0\n",
    "lab-1.0.dist-info/entry_points.txt": "[lab.nodes]\nlidar = lab.lidar:Lidar\n",
}


@pytest.fixture(autouse=True)
def path(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A path with nothing on it, and no finder of distributions but the standard one."""
    path: list[str] = []
    monkeypatch.setattr(sys, "path", path)
    monkeypatch.setattr(sys, "meta_path", [PathFinder])
    return path


def found() -> list[tuple[str, str]]:
    return [(each.name, each.value) for each in entry_points("lab.nodes")]


def test_folder_with_metadata_offers_its_entries(path: list[str], tmp_path: Path):
    for name, text in METADATA.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    path.append(str(tmp_path))
    assert found() == [("lidar", "lab.lidar:Lidar")]


def test_zip_file_on_the_path_offers_its_entries(path: list[str], tmp_path: Path):
    with zipfile.ZipFile(tmp_path / "lab.zip", "w") as file:
        for name, text in METADATA.items():
            file.writestr(name, text)
    path.append(str(tmp_path / "lab.zip"))
    assert found() == [("lidar", "lab.lidar:Lidar")]


def test_missing_folder_offers_nothing(path: list[str], tmp_path: Path):
    (tmp_path / "other-1.0.egg-info").mkdir()
    path.extend([str(tmp_path / "absent"), str(tmp_path)])
    assert found() == []


def test_source_of_module_is_found_without_import(path: list[str], tmp_path: Path):
    package = tmp_path / "unimported"
    package.mkdir()
    (package / "__init__.py").write_text("raise AssertionError")
    (package / "inner.py").write_text("")
    path.append(str(tmp_path))
    assert source_of("unimported.inner") == package / "inner.py"
    assert source_of("unimported.absent") is None


def test_entry_points_of_new_distribution_are_found(path: list[str], tmp_path: Path):
    assert list(entry_points("busflow.absent")) == []
    offered = tmp_path / "some-1.0.dist-info"
    offered.mkdir()
    (offered / "METADATA").write_text("Metadata-Version: 2.1\nName: some\nVersion: 1.0\n")
    (offered / "entry_points.txt").write_text("[busflow.absent]\none = some:thing\n")
    path.append(str(tmp_path))
    assert [each.name for each in entry_points("busflow.absent")] == ["one"]
