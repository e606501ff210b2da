"""The benchmarks of the page and its server work from end to end; how fast anything is, no test says."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROC = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="they read /proc")
BROWSER = any(map(shutil.which, ("chromium", "chromium-browser", "google-chrome")))
BUNDLER = (ROOT / "ui/page/node_modules").exists()


@PROC
@pytest.mark.parametrize(
    "words",
    [
        ["benchmarks/ui.py", "--seconds", "1"],
        pytest.param(
            ["benchmarks/ui_browser.py", "--frames", "5"],
            marks=pytest.mark.skipif(not (BROWSER and BUNDLER), reason="no Chromium, or no `npm ci` in ui/page"),
        ),
    ],
    ids=lambda words: words[0],
)
def test_benchmark_runs_one_short_round(words):
    module = words[0].removesuffix(".py").replace("/", ".")
    ended = subprocess.run(
        [sys.executable, "-m", module, *words[1:]], cwd=ROOT, capture_output=True, text=True, timeout=150
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert any(map(str.isdigit, ended.stdout)), "it prints no figure"
