"""`busflow log`: the last lines of a run, and following it until it ends."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main
from tests.vectors import each_case

Captured = pytest.CaptureFixture[str]


@pytest.mark.usefixtures("lab")
class TestKeptLines:
    def test_lines_are_printed_as_logged_and_escaped(self, capsys: Captured):
        assert main(["log"]) == 0
        out = capsys.readouterr().out
        (line,) = (line for line in out.splitlines() if "/processor: works" in line)
        assert line.endswith(r" info     /processor: works path=\x1b[31m")

    def test_node_and_level_choose_among_them(self, capsys: Captured):
        assert main(["log", "--node", "processor"]) == 0
        assert len(capsys.readouterr().out.splitlines()) == 1
        assert main(["log", "--node", "processor", "--level", "warning"]) == 0
        assert capsys.readouterr().out == ""
        assert main(["log", "-n", "0"]) == 0
        assert capsys.readouterr().out == ""

    def test_json_is_one_object_a_line(self, capsys: Captured):
        assert main(["log", "--node", "/processor", "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert (answer["version"], answer["level"], answer["node"]) == (1, 20, "/processor")
        assert answer["text"] == r"works path=\x1b[31m"
        assert answer["stamp_ns"] > 1_700_000_000 * 10**9

    def test_follow_ends_with_its_reader(self):
        command = f"{sys.executable} -m busflow log -f --node processor | head -1; echo ${{PIPESTATUS[0]}}"
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60)
        assert done.stdout.splitlines()[1:] == ["0"]
        assert done.stderr == ""

    def test_unknown_node_gets_the_nearest_name(self, capsys: Captured):
        assert main(["log", "--node", "procesor"]) == 4
        assert "did you mean '/processor'?" in capsys.readouterr().err


@pytest.mark.e2e
def test_level_of_a_node_is_set(project: Path, start_run: Callable[..., Any], capsys: Captured):
    plugin = project / "plugins/listener.py"
    plugin.write_text(
        plugin.read_text().replace('self.log.info("heard"', 'self.log.debug("quietly")\n        self.log.info("heard"')
    )
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    assert main(["log", "--set", "listener", "debug"]) == 0
    assert capsys.readouterr() == ("/listener: logs from debug on\n", "")
    run.wait_for("quietly")
    assert main(["log", "--set", "listener", "fatal", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["node"], answer["level"]) == ("/listener", "critical")
    assert main(["log", "--set", "listner", "debug"]) == 4
    assert "there is no node /listner; did you mean '/listener'?" in capsys.readouterr().err
    assert main(["log", "-f", "--set", "listener", "debug"]) == 2
    assert "--set shows no lines" in capsys.readouterr().err


@each_case("b_names", "loglevel/")
@pytest.mark.usefixtures("place")
def test_word_of_a_level_is_known_or_refused(case: dict[str, Any]):
    assert main(["log", "--set", "listener", case["input"]]) == (4 if case["valid"] else 2)  # nothing runs


@pytest.mark.e2e
def test_follow_prints_all_lines_until_the_end(project: Path, start_run: Callable[..., Any], place: Any):
    start_run(project, "talk.yaml", "--watchdog", "off").wait_for("heard")
    command = [sys.executable, "-m", "busflow", "log", "-f", "-n", "1"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, **pipes, text=True, env=place.environment) as following:
        lines = [following.stdout.readline() for _ in range(100)]
        assert main(["param", "set", "talker", "fail_at", "1"]) == 0
        out, err = following.communicate(timeout=60)
    assert (following.returncode, err) == (0, "the run talk has ended\n")
    lines += out.splitlines()
    numbers = [float(line.partition("number=")[2]) for line in lines if "/listener: heard" in line]
    assert numbers == [numbers[0] + n for n in range(len(numbers))], "none is missing, none comes twice"
    assert r"/talker: failed in Talker.talk (timer): ValueError: \x1b[31mlost count" in lines[-1]
