"""Fixtures of tests that load files: a folder that is the working directory, and a launch file with machines."""

from collections.abc import Mapping
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest

from busflow.launchfile.load.load import examine, load
from busflow.launchfile.model.description import LaunchDescription

MACHINES = """
machines:
  arm: {connect: "tls/192.0.2.7:7447"}
  head: {connect: "tls/[2001:db8::1]:7447", listen: "tls/0.0.0.0:7001", cert: keys/h.pem}
network: {ca: certs/ca.pem, allow: {viewer: read, boss: all}}
processes:
  eyes: {machine: head}
  ears:
nodes:
  camera: {plugin: p, process: eyes}
  motor: {plugin: p, machine: arm}
  planner: {plugin: p}
  listener: {plugin: p, process: ears}
"""


class Folder:
    """Folder of launch files, which is the working directory."""

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
        """Return every problem of a file, as the command line prints it."""
        self.write(text)
        _, problems = examine("lab1.yaml", environment=env or {}, **how)
        return "\n".join(problem.render() for problem in problems)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Folder:
    monkeypatch.chdir(tmp_path)
    return Folder(tmp_path)


@pytest.fixture
def machines(folder: Folder) -> LaunchDescription:
    folder.write(MACHINES)
    return load("lab1.yaml")
