"""Programs of a run that the installed command starts: their end with it, and what other terminals see of them."""

import json
import os
import signal
import sys

import pytest

from busflow.cli import main
from tests.processes.conftest import NODES, ended

pytestmark = pytest.mark.e2e
PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""
FAMILY = """
programs:
  driver:
    command: [sh, -c, "sh -c 'echo child $$; exec sleep 600' & setsid sh -c 'echo daemon $$; exec sleep 600' & wait"]
    grace: 200ms
"""
"""A program with a child in its process group, and one in a session of its own."""


def family(run):
    """The numbers of a program and its two children."""
    run.wait_for("child ")
    run.wait_for("daemon ")
    run.wait_for("the program is started")
    lines = [each for each in run.log() if each["node"] == "/driver"]
    return [
        *(each["pid"] for each in lines if "pid" in each),
        *(int(each["event"].split()[1]) for each in lines if each["event"].split()[0] in {"child", "daemon"}),
    ]


def test_killed_run_leaves_no_process_behind(start):
    run = start(FAMILY)
    pids = family(run)
    assert len(pids) == 3
    run.process.kill()
    assert ended(pids, PATIENCE_S)


def test_interrupted_run_ends_programs_and_accounts(start):
    run = start(FAMILY)
    pids = family(run)
    assert run.end(signal.SIGINT) == 130
    assert ended(pids, 0.0)
    (program,) = run.report()["programs"]
    assert (program["name"], program["state"], program["exit_codes"]) == ("/driver", "ended", [-signal.SIGINT])
    table = "".join(run.printed)
    assert "SIGINT" in table


def test_failure_of_program_is_exit_code_1(start):
    run = start('programs: {driver: {command: [sh, -c, "echo cable loose; exit 3"]}}')
    assert run.end(None) == 1
    assert run.lines[-1].startswith("error: the program /driver ")
    assert [each["level"] for each in run.log() if each["event"] == "cable loose"] == ["info"]
    assert run.report()["exit_code"] == 1


@pytest.fixture
def place(start, monkeypatch):
    """A run with a program that runs, one that waits, and one that was restarted, as this process finds it."""
    run = start("""
programs:
  driver: {command: [sleep, 600]}
  flaky: {command: [sh, -c, "test -f x && exec sleep 600; touch x; exit 3"], restart: on-failure}
  late: {command: [sleep, 600], depends_on: {slow: ready}}
  slow: {command: [sleep, 600], ready: never said}
""")
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
    run.wait_for("the program is started", times=4)
    return run


@pytest.mark.usefixtures("place")
def test_other_terminals_see_programs(capsys, golden):
    assert main(["ps", "--json"]) == 0
    programs = {each["name"]: each for each in json.loads(capsys.readouterr().out)["programs"]}
    assert {name: (each["state"], each["restarts"]) for name, each in programs.items()} == {
        "/driver": ("running", 0),
        "/flaky": ("running", 1),
        "/late": ("waiting", 0),
        "/slow": ("running", 0),
    }
    assert programs["/driver"]["command"] == ["sleep", "600"]
    assert os.kill(programs["/driver"]["pid"], 0) is None
    assert main(["ps"]) == 0
    out = capsys.readouterr().out
    assert "PROGRAMS" in out
    assert "/late waiting" in out
    assert main(["doctor", "--json"]) == 3
    findings = json.loads(capsys.readouterr().out)["findings"]
    golden("\n".join(f"{each['code']}: {each['message']}" for each in findings), "doctor")
    assert main(["node", "info", "driver"]) == 4
    golden(capsys.readouterr().err, "node info")
    assert main(["log", "--node", "driver", "--json"]) == 0
    first, *_ = capsys.readouterr().out.splitlines()
    assert json.loads(first)["text"].startswith("the program ")


def test_simulated_run_starts_no_program(project, monkeypatch, capsys):
    monkeypatch.chdir(project)
    (project / "run.yaml").write_text(
        f"plugins: [{NODES}]"
        """
nodes: {quick: {plugin: "quick:Quick", depends_on: {driver: started}}}
programs: {driver: {command: [no-such-command]}}
"""
    )
    assert main(["run", "run.yaml", "--sim", "--for", "1s"]) == 0
    out, err = capsys.readouterr()
    assert ": /driver" in err
    assert "node starts" in err
    assert "SIGINT" not in out


def test_simulator_may_be_a_program_of_run(start):
    run = start(f"""
clock: {{mode: follow}}
nodes: {{quick: {{plugin: "quick:Quick"}}}}
programs:
  simulator:
    command: [{sys.executable}, -m, busflow, topic, pub, /clock, rosgraph_msgs/msg/Clock, "clock: {{sec: 7}}"]
    ready: publishing
""")
    run.wait_for("publishing #1")
    assert run.end(signal.SIGINT) == 130
    assert run.report()["duration_s"] >= 0


def test_programs_run_beside_worker_processes(start):
    run = start("""
processes: {left: {}}
nodes: {quick: {plugin: "quick:Quick", process: left}}
programs: {driver: {command: [sh, -c, "echo on; exec sleep 600"]}}
""")
    run.wait_for("node starts")
    run.wait_for("on")
    assert run.end(signal.SIGTERM) == 143
    (program,) = run.report()["programs"]
    assert program["exit_codes"] == [-signal.SIGINT]
