"""`busflow run`: its output, reports and exit codes."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from busflow.cli import main
from busflow.errors import ExitCode

BUSFLOW = [sys.executable, "-m", "busflow"]

pytestmark = pytest.mark.usefixtures("project")

Captured = pytest.CaptureFixture[str]

NEEDS_UVLOOP = pytest.mark.needs("uvloop")


def test_run_logs_to_stderr_and_prints_tables(capsys: Captured):
    assert main(["run", "talk.yaml", "--sim", "--for", "0.2"]) == 0
    captured = capsys.readouterr()
    assert "/listener: heard number=1.0" in captured.err
    assert "talk: 0.200 s of sim time" in captured.out
    topic, listener = (line.split() for line in captured.out.splitlines() if line.startswith(("/numbers", "  →")))
    assert topic[:3] == ["/numbers", "std_msgs/msg/Float64", listener[5]]
    assert listener[1:5] == ["/listener", "depth", "10,", "drop_oldest"]
    assert "/talker  talk" in captured.out


@pytest.mark.parametrize("processes", ["file", pytest.param("auto", marks=pytest.mark.long)])
def test_one_node_runs_without_a_file(capsys: Captured, processes: str):
    command = ["--plugin", "talker", "rate_hz:=200", "--node", "left/loud", "-r", "numbers:=/words"]
    options = ["--for", "200ms", "--report", "run.json", "--processes", processes, "--set", "shutdown.grace=20s"]
    assert main(["run", *command, *options]) == 0
    assert " s of system time" in capsys.readouterr().out
    report = json.loads(Path("run.json").read_text())
    assert [(node["name"], node["state"]) for node in report["nodes"]] == [("/left/loud", "stopped")]
    assert [timer["period_s"] for timer in report["timers"]] == [0.005]
    assert {topic["name"]: topic["published"] > 0 for topic in report["topics"]} == {"/words": True}


def test_one_node_runs_on_simulated_time(capsys: Captured):
    assert main(["run", "--plugin", "talker", "rate_hz:=5", "--sim", "--for", "10min"]) == 0
    assert "talker: 600.000 s of sim time" in capsys.readouterr().out
    assert main(["run", "--plugin", "talker", "-h"]) == 0
    assert "busflow plugins info talker shows its parameters." in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("--plugin talkr", "there is no plugin 'talkr'"),
        ("--plugin talker rat_hz:=5", "command line:1:1: error: /talker: unknown parameter rat_hz"),
        (
            "--plugin talker rate_hz:=fast",
            "command line:1:10: error: /talker: rate_hz must be a number, got text 'fast'",
        ),
        ("--plugin talker talk.yaml", "name a launch file, or a plugin with --plugin: not both talk.yaml"),
        ("--plugin talker --profile sim", "--profile is for FILE: a node alone has no profiles"),
        ("--plugin talker --watch", "--watch follows edits of FILE; with --plugin there is no FILE"),
        ("--plugin talker --folder nowhere", "Directory 'nowhere' does not exist"),
        ("talk.yaml --node loud", "--node and --folder are for --plugin"),
        ("talk.yaml -r a:=b", "with FILE write --set nodes.NODE.remap.OLD=NEW"),
    ],
)
def test_wrong_use_of_plugin_is_explained(capsys: Captured, arguments: str, expected: str):
    assert main(["run", *arguments.split()]) == 2
    assert expected in capsys.readouterr().err


def test_the_report_accounts_for_every_message():
    assert main(["run", "talk.yaml", "--for", "200ms", "--seed", "7", "--report", "run.json"]) == 0
    report = json.loads(Path("run.json").read_text())
    assert (report["name"], report["seed"], report["clock"], report["exit_code"]) == ("talk", 7, "system", 0)
    assert [node["name"] for node in report["nodes"]] == ["/talker", "/listener"]
    (topic,) = report["topics"]
    (line,) = topic["subscriptions"]
    assert topic["published"] == line["published"] == line["delivered"] + line["dropped"] + line["queued"] > 0
    assert report["timers"][0]["fired"] == topic["published"]


def test_table_and_report_account_for_every_call(capsys: Captured):
    Path("plugins/talker.py").write_text(
        "from busflow import Node, ServiceFailed, client, service, timer\n"
        "from busflow.msgs.std_srvs import Trigger\n\n\n"
        "class Talker(Node):\n"
        "    own = client(Trigger, '~/reset')\n\n"
        "    @service(Trigger, '~/reset')\n"
        "    def on_reset(self, request: Trigger.Request) -> Trigger.Response:\n"
        "        if self.own.called == 2:\n"
        "            raise ValueError('enough')\n"
        "        return Trigger.Response()\n\n"
        "    @timer(0.1)\n"
        "    async def ask(self) -> None:\n"
        "        try:\n"
        "            await self.own.call()\n"
        "        except ServiceFailed:\n"
        "            pass\n"
    )
    file = Path("talk.yaml")
    file.write_text(file.read_text().replace('    parameters: {rate_hz: "${args.rate_hz}"}\n', ""))
    assert main(["run", "talk.yaml", "--sim", "--for", "0.35", "--report", "report.json"]) == 0
    shown = capsys.readouterr()
    rows = [line.split() for line in shown.out.splitlines() if "/talker" in line]
    assert ["/talker/reset", "std_srvs/srv/Trigger"] in rows
    assert ["←", "/talker", "depth", "10", "3", "2", "1", "0"] in rows
    assert ["→", "/talker", "3", "2", "1", "0"] in rows  # nothing was lost or withdrawn, and has no column
    assert "failed in Talker.on_reset (service /talker/reset): ValueError: enough (plugins/talker.py:" in shown.err
    (answer,) = json.loads(Path("report.json").read_text())["services"]
    assert (answer["name"], answer["type"]) == ("/talker/reset", "std_srvs/srv/Trigger")
    assert (answer["servers"][0]["served"], answer["clients"][0]["errors"]) == (2, {"ServiceFailed": 1})


def test_json_logs_are_one_object_a_line(capsys: Captured):
    assert main(["run", "talk.yaml", "--for", "50ms", "--log-format", "json", "--watchdog", "off"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().err.splitlines()]
    assert {"node": "/listener", "event": "heard", "number": 1.0}.items() <= lines[0].items()


def test_arguments_and_set_change_the_run(capsys: Captured):
    assert main(["run", "talk.yaml", "rate_hz:=20", "--for", "50ms"]) == 0
    assert "0.05 s" in capsys.readouterr().out
    assert main(["run", "talk.yaml", "--set", "nodes.talker.parameters.rate_hz=25", "--for", "50ms"]) == 0
    assert "0.04 s" in capsys.readouterr().out


def test_failing_node_is_reported_with_full_accounts(capsys: Captured):
    failing = ["--set", "nodes.talker.parameters.fail_at=3"]
    assert main(["run", "talk.yaml", *failing, "--report", "run.json"]) == 1
    captured = capsys.readouterr()
    assert "node /talker failed in Talker.talk" in captured.err
    assert "plugins/talker.py:22" in captured.err
    assert r"ValueError: \x1b[31mlost count" in captured.err
    assert captured.err.count("failed in") == 1
    assert "\x1b" not in captured.err + captured.out
    assert "exit code 1" in captured.out
    report = json.loads(Path("run.json").read_text())
    assert report["exit_code"] == 1
    assert {node["name"]: node["state"] for node in report["nodes"]}["/talker"] == "failed"


def test_json_log_has_the_failing_node(capsys: Captured):
    main(["run", "talk.yaml", "--set", "nodes.talker.parameters.fail_at=3", "--log-format", "json"])
    records = [json.loads(line) for line in capsys.readouterr().err.splitlines() if line.startswith("{")]
    assert [(each["node"], each["level"]) for each in records if "lost count" in each["event"]] == [
        ("/talker", "error")
    ]


def test_invalid_file_leaves_no_report(capsys: Captured):
    assert main(["run", "talk.yaml", "--set", "nodes.talker.parameters.rate_hz=fast", "--report", "run.json"]) == 2
    captured = capsys.readouterr()
    assert "rate_hz" in captured.err
    assert captured.out == ""
    assert not Path("run.json").exists()


def test_impossible_machine_is_left_out(capsys: Captured):
    assert main(["run", "talk.yaml", "--machine", "arm"]) == 2
    message = "error: talk has no machine arm\n  fix: leave --machine out: the file names no machines\n"
    assert capsys.readouterr() == ("", message)


@pytest.mark.parametrize("option", ["--report", "--trace"])
def test_disk_full_at_end_keeps_the_table(capsys: Captured, option: str):
    assert main(["run", "talk.yaml", "--sim", "--for", "2s", option, "/dev/full"]) == 1
    out, err = capsys.readouterr()
    assert "published" in out
    assert "exit code 1\n" in out
    assert err.splitlines()[-1] == "error: cannot write the whole of /dev/full: No space left on device"
    assert "Traceback" not in err


@pytest.mark.parametrize("path", ["/proc/run.json", "missing/run.json", "plugins"])
def test_unwritable_report_is_refused_before_the_run(capsys: Captured, path: str):
    assert main(["run", "talk.yaml", "--report", path]) == 2
    assert f"cannot write {path}" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--report", "--trace"])
@pytest.mark.parametrize("path", ["whole.yaml", "plugins/../talk.yaml", "link.json"])
def test_input_files_are_not_overwritten(capsys: Captured, option: str, path: str):
    Path("whole.yaml").write_text("include: talk.yaml\n")
    Path("link.json").symlink_to("talk.yaml")
    before = Path(path).read_text()
    assert main(["run", "whole.yaml", "--sim", "--for", "1s", option, path]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert f"{option}: {path} is a file of this run" in err
    assert Path(path).read_text() == before


def test_a_report_and_a_trace_are_two_files(capsys: Captured):
    assert main(["run", "talk.yaml", "--sim", "--for", "1s", "--report", "run.txt", "--trace", "./run.txt"]) == 2
    assert "--trace: the report is written to run.txt" in capsys.readouterr().err
    assert not Path("run.txt").exists()
    assert main(["run", "talk.yaml", "--sim", "--for", "1s", "--report", "/dev/null", "--trace", "/dev/null"]) == 0


def test_help_with_a_file_shows_its_arguments(capsys: Captured):
    assert main(["run", "talk.yaml", "--help"]) == 0
    out = capsys.readouterr().out
    assert "Usage: busflow run [OPTIONS] FILE" in out
    assert "rate_hz:=  float  = 100.0  at most 1000  How often to talk." in out


def test_help_lists_arguments_that_have_no_value_yet(capsys: Captured):
    text = Path("talk.yaml").read_text()
    Path("talk.yaml").write_text(text.replace("default: 100.0, ", ""))
    assert main(["run", "talk.yaml", "--help"]) == 0
    assert "rate_hz:=  float  required" in capsys.readouterr().out


@pytest.mark.e2e
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signal_ends_the_run_with_its_table(number: signal.Signals, code: int):
    with subprocess.Popen(
        [*BUSFLOW, "run", "talk.yaml", "--report", "run.json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stderr is not None
        process.stderr.readline()
        assert not Path("run.json").exists(), "a run that is killed now leaves no empty file"
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert process.returncode == code
    assert b"Traceback" not in err
    assert f"exit code {code}".encode() in out
    assert json.loads(Path("run.json").read_text())["exit_code"] == code


@pytest.mark.e2e
@pytest.mark.parametrize(
    ("command", "code"),
    [
        (["run", "talk.yaml", "--sim", "--for", "50ms"], ExitCode.OK),
        (["run", "talk.yaml", "--sim", "--set", "nodes.talker.parameters.fail_at=2"], ExitCode.FAILED),
        (["test", "talk.yaml", "--set", "nodes.talker.parameters.fail_at=2"], ExitCode.FAILED),
    ],
)
def test_exit_code_stays_without_a_reader(command, code):
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([*BUSFLOW, *command], stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    assert done.returncode == code
    assert b"Error:" not in done.stderr.replace(b"ValueError:", b"")


FRAGILE = """
import time

from busflow import Node, timer


class Talker(Node):
    lives = 0

    async def start(self) -> None:
        Talker.lives += 1

    @timer(0.05)
    def talk(self) -> None:
        if Talker.lives == 1:
            raise ValueError("not yet")
        if self.talk.fired == 3:
            time.sleep(0.4)
"""


@pytest.mark.parametrize(
    ("watchdog", "loop"),
    [("100ms", "busflow"), ("off", "busflow"), pytest.param("100ms", "uvloop", marks=NEEDS_UVLOOP)],
)
def test_restarts_and_blocks_are_in_the_report(capsys: Captured, watchdog: str, loop: str):
    Path("plugins/talker.py").write_text(FRAGILE)
    Path("fragile.yaml").write_text("plugins: [plugins]\nnodes: {talker: {plugin: talker, restart: on-failure}}\n")
    arguments = ["fragile.yaml", "--for", "1s", "--watchdog", watchdog, "--event-loop", loop, "--report", "run.json"]
    assert main(["run", *arguments]) == 0
    captured, report = capsys.readouterr(), json.loads(Path("run.json").read_text())
    assert "/talker: failed once and was started anew once; the last time it failed in Talker.talk" in captured.out
    (node,) = report["nodes"]
    assert (node["state"], node["restarts"], node["failures"]) == ("stopped", 1, 1)
    reported = "timer talk blocked the event loop once" in captured.out
    assert reported == ("plugins/talker.py:18 in talk" in captured.err) == (watchdog != "off")
    assert [each["handler"] for each in report["blocks"]] == (["timer talk"] if reported else [])


@pytest.mark.parametrize("simulated", [True, False], ids=["simulated time", "not installed"])
def test_missing_event_loop_is_refused_before_the_run(
    capsys: Captured, monkeypatch: pytest.MonkeyPatch, simulated: bool
):
    monkeypatch.setitem(sys.modules, "uvloop", None)
    arguments = ["--event-loop", "uvloop", "--report", "run.json", *(["--sim"] if simulated else [])]
    assert main(["run", "talk.yaml", *arguments]) == 2
    out, err = capsys.readouterr()
    assert (out, Path("run.json").exists()) == ("", False)
    assert ("simulated time has an event loop of its own" in err) is simulated
    assert ("fix: in a clone of busflow: pip install '.[uvloop]'" in err) is not simulated


def test_watchdog_takes_a_duration_or_off(capsys: Captured):
    assert main(["run", "talk.yaml", "--watchdog", "on"]) == 2
    assert "--watchdog" in capsys.readouterr().err


def test_negative_seed_is_refused(capsys: Captured):
    assert main(["run", "talk.yaml", "--sim", "--seed", "-1", "--for", "1s"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "'--seed': -1 is not in the range x>=0" in err


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["run", "talk.yaml", "--one-process", "--processes", "auto", "--for", "0.2s"], "exclude each other"),
        (["test", "talk.yaml", "--seeds", "2", "--seed", "5"], "--seed and --seeds exclude each other"),
        (
            ["run", "talk.yaml", "rate_hz:=5", "rate_hz:=6", "--for", "0.2s"],
            "command line:1:1: error: the argument rate_hz is given twice",
        ),
    ],
)
def test_conflicting_options_are_refused(arguments: list[str], expected: str, capsys: Captured):
    assert main(arguments) == 2
    assert expected in capsys.readouterr().err


@pytest.mark.parametrize(("command", "usage"), [("graph", "[FILE]"), ("replay", "RECORDING [FILE]"), ("run", "FILE")])
def test_help_shows_which_file_may_be_left_out(command: str, usage: str, capsys: Captured):
    assert main([command, "--help"]) == 0
    assert f"{command} [OPTIONS] {usage} [NAME:=VALUE]..." in capsys.readouterr().out
