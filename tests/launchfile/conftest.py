"""What the launch tests share: a folder in which files are written and loaded by relative names."""

from collections.abc import Mapping
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest

from busflow.launchfile.load.load import examine, load
from busflow.launchfile.model.description import LaunchDescription


class Folder:
    """Launch files under a folder of their own, which is the working directory."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def write(self, text: str | bytes, name: str = "lab1.yaml") -> Path:
        path = self.path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else dedent(text).encode())
        return path

    def load(self, text: str | bytes, *, env: Mapping[str, str] | None = None, **how: Any) -> LaunchDescription:
        self.write(text)
        return load("lab1.yaml", environment=env or {}, **how)

    def report(self, text: str | bytes, *, env: Mapping[str, str] | None = None, **how: Any) -> str:
        """Every problem of a file, as a person sees them."""
        self.write(text)
        _, problems = examine("lab1.yaml", environment=env or {}, **how)
        return "\n".join(problem.render() for problem in problems)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Folder:
    monkeypatch.chdir(tmp_path)
    return Folder(tmp_path)
