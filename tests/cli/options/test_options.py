"""Tests of `bag.py`, `launch_file.py`, `message.py` and `run.py`: options that several commands share.

Those of `interfaces.py` are in `tests/cli/interface/test_interface.py`.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from subprocess import PIPE
from typing import Any

import click
import pytest

from busflow.cli.options.bag import listed, named, stretch
from busflow.cli.options.launch_file import DURATION, DURATION_OR_OFF, LaunchSource
from busflow.cli.options.message import wants
from busflow.cli.options.run import completer, full_type
from busflow.cli.terminal.message_text import TextForm, Wanted
from busflow.errors import LaunchError, NoSuchTarget
from busflow.recording.bag.bag import Bag
from tests.cli.conftest import Shell
from tests.golden import Golden
from tests.recording.conftest import write_numbers

Captured = pytest.CaptureFixture[str]


class TestBag:
    def test_start_and_end_count_from_the_first_message(self, tmp_path: Path):
        with Bag(write_numbers(tmp_path / "numbers.mcap", 500)) as bag:
            assert stretch(bag, None, None) == (None, None)
            begin = bag.start_ns or 0
            assert stretch(bag, 0.0, 0.5) == (begin, begin + 500_000_000)
            with pytest.raises(click.UsageError):
                stretch(bag, 1e6, None)

    def test_topics_need_no_leading_slash(self, tmp_path: Path):
        with Bag(write_numbers(tmp_path / "numbers.mcap", 1)) as bag:
            assert named(["number"], bag) == named(["/number"], bag) == list(bag.channels)
            with pytest.raises(NoSuchTarget):
                named(["numbr"], bag)

    def test_names_are_separated_by_commas(self):
        context, parameter = click.Context(click.Command("diff")), click.Option(["--topics"])
        assert listed(context, parameter, None) == []
        assert listed(context, parameter, " a,, b ") == ["a", "b"]


@pytest.mark.usefixtures("project")
class TestLaunchFile:
    def source(self, *assignments: str, sets: tuple[str, ...] = ()) -> LaunchSource:
        return LaunchSource(Path("talk.yaml"), assignments, sets)

    def test_overrides_are_in_the_description(self):
        with click.Context(click.Command("run")):
            assert self.source(sets=("name=other",)).description().name == "other"

    def test_problems_of_file_and_nodes_are_one_error(self):
        text = Path("talk.yaml").read_text()
        Path("talk.yaml").write_text(text.replace("plugin: listener", "plugin: lstener") + "nme: talk\n")
        with click.Context(click.Command("run")), pytest.raises(LaunchError) as caught:
            self.source().description()
        assert [each.code for each in caught.value.problems] == ["unknown-plugin", "unknown-key"]

    def test_variables_of_the_file_end_with_the_command(self, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.setenv("LAB", "before")
        with Path("talk.yaml").open("a") as file:
            file.write("env: {LAB: lab1, SENSOR: imu}\n")
        with click.Context(click.Command("run")):
            self.source().description()
            assert (os.environ["LAB"], os.environ["SENSOR"]) == ("lab1", "imu")
        assert (os.environ["LAB"], "SENSOR" in os.environ) == ("before", False)

    def test_durations_are_seconds_or_have_a_unit(self):
        convert = DURATION.convert
        assert (convert("5", None, None), convert("50ms", None, None)) == (5.0, 0.05)
        assert DURATION_OR_OFF.convert("off", None, None) is None
        with pytest.raises(click.BadParameter):
            convert("soon", None, None)


class TestMessage:
    def wanted(self, *arguments: str) -> Wanted:
        command = click.command(wants(click.option("--json", "as_json", is_flag=True)(lambda wanted: wanted)))
        return command.main(list(arguments), standalone_mode=False)

    def test_options_choose_format_and_limits(self):
        plain = self.wanted()
        assert (plain.form, plain.abridger.truncate_after) == (TextForm.YAML, 128)
        assert self.wanted("--csv", "-l", "3").abridger.truncate_after == 3
        assert self.wanted("-f").abridger.truncate_after is None

    def test_formats_exclude_each_other(self):
        with pytest.raises(click.UsageError):
            self.wanted("--csv", "--raw")
        with pytest.raises(click.UsageError):
            self.wanted("--raw", "--field", "data")


class TestRun:
    def test_middle_of_a_type_may_be_left_out(self):
        assert (
            full_type("std_srvs/Trigger", "srv") == full_type("std_srvs/srv/Trigger", "srv") == "std_srvs/srv/Trigger"
        )

    def test_completion_hides_errors(self):
        context, parameter = click.Context(click.Command("echo")), click.Argument(["name"])
        names = completer(lambda _context, _incomplete: [("imu", "an IMU"), ("joints", None)])
        assert [(each.value, each.help) for each in names(context, parameter, "i")] == [("imu", "an IMU")]

        @completer
        def failing(_context: click.Context, _incomplete: str) -> list[tuple[str, None]]:
            raise OSError("no run")

        assert failing(context, parameter, "") == []

    @pytest.mark.usefixtures("lab")
    def test_run_is_joined_by_name(self, shell: Shell):
        assert shell.data("node list --run imu_lab")["run"] == "imu_lab"

    def test_listeners_end_alike_with_their_run(self, start_run: Callable[..., Any], project: Path, golden: Golden):
        run = start_run(project, "talk.yaml")
        run.wait_for("heard")
        verbs = ("topic echo numbers", "topic hz numbers --every 0.1", "log -f", "topic pub -w 0 /x std_msgs/Int64 {}")
        commands = [
            [sys.executable, "-u", "-m", "busflow", *verb.split()] for verb in (*verbs, f"{verbs[0]} -n 999999 --json")
        ]
        with ExitStack() as stack:
            listeners = [
                stack.enter_context(subprocess.Popen(each, stdout=PIPE, stderr=PIPE, encoding="utf-8"))
                for each in commands
            ]
            for each in listeners:
                assert each.stdout
                assert each.stdout.readline()  # by now it has joined
            run.stop()
            printed = [each.communicate(timeout=60) for each in listeners]
        assert [each.returncode for each in listeners] == [0, 0, 0, 0, 1]
        golden("\n".join(err.splitlines()[-1] for _, err in printed))
        assert json.loads(printed[-1][0].splitlines()[-1])["error"]["code"] == "run-ended"
