"""`packages:` of a launch file: folders relative to it, checked before the start."""

from __future__ import annotations

from pathlib import Path

import pytest

from busflow.errors import LaunchError
from busflow.launchfile.load.load import load
from busflow.launchfile.yaml.block import text_of
from busflow.runner.planning.resolved import resolve

NODES = "nodes: {player: {plugin: player}}\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("arm", "hand", "inner/hand"):
        (tmp_path / name).mkdir(parents=True)
    return tmp_path


def written(file: Path, packages: str) -> Path:
    file.write_text(f"{NODES}packages: {packages}\n")
    return file


def test_folders_are_relative_to_their_file(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(folder)
    description = load(written(Path("inner/lab.yaml"), "{arm: ../arm, hand: hand}"))
    assert description.packages == {"arm": folder / "arm", "hand": folder / "inner/hand"}


def test_including_file_has_the_last_word(folder: Path):
    written(folder / "inner/part.yaml", "{arm: ../arm, hand: hand}")
    file = folder / "lab.yaml"
    file.write_text("include: inner/part.yaml\npackages: {hand: hand}\n")
    assert load(file).packages == {"arm": folder / "arm", "hand": folder / "hand"}
    override = load(file, sets=[f"packages.arm={folder / 'hand'}"])
    assert override.packages["arm"] == folder / "hand"


def test_shown_description_has_whole_paths(folder: Path):
    shown = text_of(resolve(load(written(folder / "lab.yaml", "{arm: arm}"))))
    assert f"packages:\n  arm: {folder / 'arm'}" in shown


@pytest.mark.parametrize(
    ("packages", "column", "message"),
    [
        ("{arm: ../arm}", 17, "there is no folder "),
        ("{arm: lab.yaml}", 17, "there is no folder "),
        ("{a/b: arm}", 12, "'a/b' is no name of a package"),
        ("{arm: [arm]}", 17, "packages.arm must be text"),
        ("[arm]", 11, "packages must be a mapping"),
    ],
)
def test_mistake_is_found_at_its_place(folder: Path, packages: str, column: int, message: str):
    with pytest.raises(LaunchError) as refused:
        load(written(folder / "lab.yaml", packages))
    (problem,) = refused.value.problems
    assert problem.place is not None
    assert (problem.place.line, problem.place.column) == (2, column)
    assert message in problem.message
