"""The benchmarks' entry works from end to end; how fast anything is, no test says."""

import json
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from benchmarks.page import PAGE, replaced
from benchmarks.plot import Line, svg
from benchmarks.question import QUESTIONS, QUICK, find
from benchmarks.rounds import ask

ROOT = Path(__file__).parents[1]


def run(*words, cwd=ROOT):
    return subprocess.run(
        [sys.executable, "-m", "benchmarks", *words], cwd=cwd, capture_output=True, text=True, timeout=500
    )


@pytest.mark.timeout(600)
@pytest.mark.long
def test_question_prints_a_table_and_writes_data(tmp_path):
    file = tmp_path / "found.json"
    ended = run("--quick", "--without-peers", "--only", "delivery", "--json", str(file))
    assert ended.returncode == 0, ended.stderr
    table, delivery = ended.stdout, json.loads(file.read_text("utf-8"))["questions"]["delivery"]
    assert {"busflow", "asyncio.Queue", "bare calls"} == {each["contender"] for each in delivery["figures"]}
    for figure in delivery["figures"]:
        assert figure["median"] > 0, figure
        assert figure["calls"] > 0, figure
    assert "Delivery within a process" in table
    assert any(line.startswith("busflow ") and "×" in line for line in table.splitlines())
    assert "ezmsg" in delivery["missing"]
    assert any("ezmsg" in line for line in table.splitlines() if line.startswith("missing: "))


@pytest.mark.parametrize("name", [each for each in QUESTIONS if each != "delivery"])
@pytest.mark.timeout(600)
@pytest.mark.long
def test_every_question_has_figures_of_busflow(name):
    outcome = ask(find(name), QUICK, lambda _: None, peers=False)
    assert outcome.failed == {}
    assert any(contender.startswith("busflow") for contender, _, _ in outcome.figures)
    assert outcome.call_s > [0.0]


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="compares commits, and this is no clone")
@pytest.mark.timeout(600)
@pytest.mark.long
def test_paired_commits_show_which_one_is_slower(tmp_path):
    subprocess.run(["git", "clone", "-q", ROOT, tmp_path / "clone"], check=True)
    shutil.copytree(ROOT / "benchmarks", tmp_path / "clone/benchmarks", dirs_exist_ok=True)
    command = tmp_path / "clone/busflow/__main__.py"
    command.write_text(command.read_text().replace("import sys\n", "import sys\nsum(range(50_000_000))\n", 1))
    ended = run("--paired", "HEAD", "--quick", "--only", "startup", cwd=tmp_path / "clone")
    assert ended.returncode == 0, ended.stderr
    assert f"CPython {platform.python_version()}" in ended.stdout
    assert "; load " in ended.stdout
    rows = dict(re.findall(r"^busflow (.*?)  +.* (\d+\.\d+) +\d+\.\d+ +\d+\.\d+$", ended.stdout, re.MULTILINE))
    assert float(rows["--help CPU"]) > 1.5
    assert float(rows["a program CPU"]) < 1.5


def test_unknown_question_is_refused_with_known_ones():
    ended = run("--only", "speed")
    assert ended.returncode == 2
    assert "no question speed; " in ended.stderr


def test_plot_is_deterministic_and_has_both_colour_schemes():
    lines = [Line("busflow", [(1, 10.0), (10, 55.0)]), Line("a & b", [(1, 11.0), (10, 56.0)])]
    drawn = svg("Cost", "subscribers", "bare calls", lines)
    assert drawn == svg("Cost", "subscribers", "bare calls", lines)
    answer = ET.fromstring(drawn).iter("{http://www.w3.org/2000/svg}text")  # noqa: S314  # we have just written it
    texts = [each.text for each in answer]
    assert {"Cost", "busflow", "a & b", "1", "10", "100"} <= set(texts)
    assert "prefers-color-scheme: dark" in drawn


def test_new_figures_replace_only_their_place(golden):
    page = "a\n<!-- measured: x -->\n\nold\n\n<!-- end of x -->\nb\n<!-- measured: y -->\n<!-- end of y -->\n"
    assert replaced(page, "x", "new") == page.replace("old", "new")
    with golden.raises(SystemExit):
        replaced(page, "z", "new")


def test_the_page_has_a_place_for_every_question():
    text = PAGE.read_text("utf-8")
    for name in QUESTIONS:
        assert replaced(text, name, "") != ""


QUICK_ROUNDS = {
    "actions": ["--quick"],
    "attacks": ["11"],
    "balance": ["--quick"],
    "cdr": ["--quick"],
    "dds": ["--quick"],
    "definitions": ["--quick"],
    "delivery": ["--quick"],
    "frames": ["--quick"],
    "humanoid": ["--seconds", "2", "--processes", "1"],
    "inspection": ["--quick"],
    "recording": ["0.2"],
    "recording_hour": ["0.1"],
    "ros2": ["--quick"],
    "virtual_time": ["--quick"],
}
"""The benchmarks of one file, each with what makes it short."""
ELSEWHERE = {
    "assistant": "assistant/tests/test_benchmark.py",
    "chaos": "tests/processes/test_chaos.py",
    "line_attacks": "tests/processes/test_line_attacks.py",
    "recording_kills": "tests/recording/recorder/test_kills.py",
    "ui": "ui/tests/test_benchmarks.py",
    "ui_browser": "ui/tests/test_benchmarks.py",
}
"""Those that run in the tests of something else."""


@pytest.mark.parametrize(
    "name", [pytest.param(each, marks=pytest.mark.needs("dds")) if each == "dds" else each for each in QUICK_ROUNDS]
)
@pytest.mark.timeout(600)
@pytest.mark.long
def test_benchmark_runs_one_short_round(name):
    command = [sys.executable, f"benchmarks/{name}.py", *QUICK_ROUNDS[name]]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=500)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert any(map(str.isdigit, ended.stdout)), "it prints no figure"


@pytest.mark.timeout(600)
@pytest.mark.long
def test_killed_nodes_of_the_humanoid_come_back():
    command = [sys.executable, "benchmarks/humanoid.py", "--kill", "--seconds", "2"]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=500)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert " is accounted for" in ended.stdout


def test_every_benchmark_is_run_by_a_test():
    parts = {"__main__", "worker"}  # of `python -m benchmarks`, whose questions have tests above
    files = {path.stem: path.read_text("utf-8") for path in ROOT.glob("benchmarks/*.py")}
    programs = {name for name, text in files.items() if "\nif __name__ ==" in text} - parts
    assert programs == QUICK_ROUNDS.keys() | ELSEWHERE.keys()
    for name, test in ELSEWHERE.items():
        if (ROOT / test).exists() or (ROOT / test).parents[1].exists():  # a source distribution has busflow's own alone
            assert f"benchmarks/{name}.py" in (ROOT / test).read_text("utf-8")
