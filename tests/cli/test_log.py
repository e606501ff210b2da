"""`busflow log`: the last lines of a run, and following it until it ends."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main
from tests.cli.conftest import Shell, edit
from tests.vectors import each_case

TIME = {r"(?m)^\S+ (\S+ )?info": "TIME info"}


@pytest.mark.usefixtures("lab")
class TestKeptLines:
    @pytest.mark.parametrize(
        ("line", "code"),
        [
            ("--node processor", 0),
            ("--node processor --level warning", 0),
            ("-n 0", 0),
            ("--node procesor", 4),
            ("-f --set processor debug", 2),
        ],
    )
    def test_output(self, shell: Shell, line: str, code: int):
        assert shell(f"log {line}", mask=TIME) == code

    def test_all_nodes_log(self, shell: Shell):
        assert "/processor: works" in shell.text("log")

    def test_json_is_one_object_a_line(self, shell: Shell):
        answer = shell.data("log --node /processor")
        assert (answer["version"], answer["level"], answer["node"]) == (1, 20, "/processor")
        assert answer["text"] == r"works path=\x1b[31m"
        assert answer["stamp_ns"] > 1_700_000_000 * 10**9

    def test_follow_ends_with_its_reader(self):
        command = f"{sys.executable} -m busflow log -f --node processor | head -1; echo ${{PIPESTATUS[0]}}"
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60)
        assert done.stdout.splitlines()[1:] == ["0"]
        assert done.stderr == ""


@pytest.mark.e2e
def test_level_of_a_node_is_set(project: Path, start_run: Callable[..., Any], shell: Shell):
    edit('self.log.info("heard"', 'self.log.debug("quietly")\n        self.log.info("heard"', "plugins/listener.py")
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    assert shell("log --set listener debug") == 0
    run.wait_for("quietly")
    answer = shell.data("log --set listener fatal")
    assert (answer["node"], answer["level"]) == ("/listener", "critical")
    assert shell("log --set listner debug") == 4


@each_case("b_names", "loglevel/")
@pytest.mark.usefixtures("place")
def test_word_of_a_level_is_known_or_refused(case: dict[str, Any]):
    assert main(["log", "--set", "listener", case["input"]]) == (4 if case["valid"] else 2)  # nothing runs


@pytest.mark.e2e
def test_follow_prints_all_lines_until_the_end(project: Path, start_run: Callable[..., Any], place: Any, shell: Shell):
    start_run(project, "talk.yaml", "--watchdog", "off").wait_for("heard")
    command = [sys.executable, "-m", "busflow", "log", "-f", "-n", "1"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=place.environment
    ) as following:
        assert following.stdout is not None
        lines = [following.stdout.readline() for _ in range(100)]
        assert main(["param", "set", "talker", "fail_at", "1"]) == 0
        lines += following.stdout.readlines()
        assert following.stderr is not None
        err = following.stderr.read()
    assert following.returncode == 0
    numbers = [float(line.partition("number=")[2]) for line in lines if "/listener: heard" in line]
    assert numbers == [numbers[0] + n for n in range(len(numbers))], "none is missing, none comes twice"
    shell.note(f"{lines[-1]}--- errors\n{err}", mask={r"\A\S+ (\S+ )?": "TIME "})
