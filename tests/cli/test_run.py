"""`busflow run`: its output, reports and exit codes."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main
from busflow.errors import ExitCode
from tests.cli.conftest import LABS, Shell, edit

BUSFLOW = [sys.executable, "-m", "busflow"]

pytestmark = pytest.mark.usefixtures("project")

Captured = pytest.CaptureFixture[str]

NEEDS_UVLOOP = pytest.mark.needs("uvloop")
FAILING = ["--set", "nodes.talker.parameters.fail_at=3"]


def reported() -> Any:
    return json.loads(Path("run.json").read_text())


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("talk.yaml --sim --for 0.03", 0),
        ("talk.yaml rate_hz:=20 --sim --for 50ms", 0),
        ("talk.yaml --set nodes.talker.parameters.rate_hz=25 --sim --for 50ms", 0),
        ("--plugin talker rate_hz:=5 --sim --for 10min", 0),
        ("--plugin talkr", 2),
        ("--plugin talker rat_hz:=5", 2),
        ("--plugin talker rate_hz:=fast", 2),
        ("--plugin talker talk.yaml", 2),
        ("--plugin talker --profile sim", 2),
        ("--plugin talker --watch", 2),
        ("--plugin talker --folder nowhere", 2),
        ("talk.yaml --node loud", 2),
        ("talk.yaml -r a:=b", 2),
        ("talk.yaml --machine arm", 2),
        ("talk.yaml --watchdog on", 2),
        ("talk.yaml --sim --seed -1 --for 1s", 2),
        ("talk.yaml --one-process --processes auto --for 0.2s", 2),
        ("talk.yaml rate_hz:=5 rate_hz:=6 --for 0.2s", 2),
        ("talk.yaml --set nodes.talker.parameters.rate_hz=fast --report run.json", 2),
        ("talk.yaml --report /proc/run.json", 2),
        ("talk.yaml --report missing/run.json", 2),
        ("talk.yaml --report plugins", 2),
        ("talk.yaml --sim --for 1s --report run.json --trace ./run.json", 2),
        ("talk.yaml --sim --for 20ms --report /dev/full", 1),
        ("talk.yaml --sim --for 20ms --trace /dev/full", 1),
        ("talk.yaml --sim --set nodes.talker.parameters.fail_at=3", 1),
    ],
)
def test_output(shell: Shell, line: str, code: int):
    assert shell(f"run {line}", mask={r"\d\d:\d\d:\d\d\.\d+": "TIME"}) == code
    assert not Path("run.json").exists(), "a run that is refused leaves no report"


def test_help_ends_with_the_arguments_of_the_file(shell: Shell):
    ends = [shell.text(f"run {of} --help").rpartition("\n\n")[2] for of in ("talk.yaml", "--plugin talker")]
    edit("default: 100.0, ", "")
    shell.note("\n".join([*ends, shell.text("run talk.yaml --help").rpartition("\n\n")[2]]))


@pytest.mark.parametrize("processes", ["file", pytest.param("auto", marks=pytest.mark.long)])
def test_one_node_runs_without_a_file(processes: str):
    command = ["--plugin", "talker", "rate_hz:=200", "--node", "left/loud", "-r", "numbers:=/words"]
    options = ["--for", "200ms", "--report", "run.json", "--processes", processes]
    assert main(["run", *command, *options]) == 0
    report = reported()
    assert report["clock"] == "system"
    assert [(node["name"], node["state"]) for node in report["nodes"]] == [("/left/loud", "stopped")]
    assert [timer["period_s"] for timer in report["timers"]] == [0.005]
    assert {topic["name"]: topic["published"] > 0 for topic in report["topics"]} == {"/words": True}


def test_the_report_accounts_for_every_message():
    assert main(["run", "talk.yaml", "--for", "200ms", "--seed", "7", "--report", "run.json"]) == 0
    report = reported()
    assert (report["name"], report["seed"], report["clock"], report["exit_code"]) == ("talk", 7, "system", 0)
    assert [node["name"] for node in report["nodes"]] == ["/talker", "/listener"]
    (topic,) = report["topics"]
    (line,) = topic["subscriptions"]
    assert topic["published"] == line["published"] == line["delivered"] + line["dropped"] + line["queued"] > 0
    assert report["timers"][0]["fired"] == topic["published"]


def test_table_and_report_account_for_every_call(shell: Shell):
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
    edit('    parameters: {rate_hz: "${args.rate_hz}"}\n', "")
    assert shell("run talk.yaml --sim --for 0.35 --report run.json") == 0
    (answer,) = reported()["services"]
    assert (answer["name"], answer["type"]) == ("/talker/reset", "std_srvs/srv/Trigger")
    assert (answer["servers"][0]["served"], answer["clients"][0]["errors"]) == (2, {"ServiceFailed": 1})


def test_json_logs_are_one_object_a_line(capsys: Captured):
    assert main(["run", "talk.yaml", *FAILING, "--sim", "--log-format", "json", "--report", "run.json"]) == 1
    lines = [json.loads(line) for line in capsys.readouterr().err.splitlines() if line.startswith("{")]
    assert {"node": "/listener", "event": "heard", "number": 1.0}.items() <= lines[0].items()
    assert [each["node"] for each in lines if each["level"] == "error"] == ["/talker"]
    report = reported()
    assert report["exit_code"] == 1
    assert {node["name"]: node["state"] for node in report["nodes"]}["/talker"] == "failed"


@pytest.mark.parametrize("option", ["--report", "--trace"])
@pytest.mark.parametrize("path", ["whole.yaml", "plugins/../talk.yaml", "link.json"])
def test_input_files_are_not_overwritten(shell: Shell, option: str, path: str):
    Path("whole.yaml").write_text("include: talk.yaml\n")
    Path("link.json").symlink_to("talk.yaml")
    before = Path(path).read_text()
    assert shell(f"run whole.yaml --sim --for 1s {option} {path}") == 2
    assert Path(path).read_text() == before


def test_report_and_trace_may_both_be_left_out():
    assert main(["run", "talk.yaml", "--sim", "--for", "1s", "--report", "/dev/null", "--trace", "/dev/null"]) == 0


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
    assert reported()["exit_code"] == code


@pytest.mark.e2e
@pytest.mark.parametrize(
    ("command", "code"),
    [
        (["run", "talk.yaml", "--sim", "--for", "50ms"], ExitCode.OK),
        (["run", "talk.yaml", "--sim", *FAILING], ExitCode.FAILED),
        (["test", "talk.yaml", *FAILING], ExitCode.FAILED),
    ],
)
def test_exit_code_stays_without_a_reader(command, code):
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([*BUSFLOW, *command], stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    assert done.returncode == code
    assert b"Error:" not in done.stderr.replace(b"ValueError:", b"")


@pytest.mark.parametrize(
    ("watchdog", "loop"),
    [("100ms", "busflow"), ("off", "busflow"), pytest.param("100ms", "uvloop", marks=NEEDS_UVLOOP)],
)
def test_restarts_and_blocks_are_in_the_report(capsys: Captured, watchdog: str, loop: str):
    shutil.copy(LABS / "plugins/fragile.py", "plugins/fragile.py")
    node = "{plugin: fragile, restart: on-failure, on_exit: shutdown}"
    Path("fragile.yaml").write_text(f"plugins: [plugins]\nnodes: {{fragile: {node}}}\n")
    arguments = ["fragile.yaml", "--watchdog", watchdog, "--event-loop", loop, "--report", "run.json"]
    assert main(["run", *arguments]) == 0
    captured, report = capsys.readouterr(), reported()
    (fragile,) = report["nodes"]
    assert (fragile["state"], fragile["restarts"], fragile["failures"]) == ("stopped", 1, 1)
    reported_at = "plugins/fragile.py:22 in beat" in captured.err
    assert reported_at == (watchdog != "off")
    handlers = {each["handler"] for each in report["blocks"]}  # a busy machine may hold up others too
    assert handlers >= {"timer beat"} if reported_at else not handlers


@pytest.mark.parametrize("more", ["", " --sim"], ids=["not installed", "simulated time"])
def test_missing_event_loop_is_refused_before_the_run(shell: Shell, monkeypatch: pytest.MonkeyPatch, more: str):
    monkeypatch.setitem(sys.modules, "uvloop", None)
    assert shell(f"run talk.yaml --event-loop uvloop --report run.json{more}") == 2
    assert not Path("run.json").exists()
