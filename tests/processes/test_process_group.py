"""A run of several processes: nothing is lost at the start, all end together, and what dies is started anew."""

import json
import os
import re
import signal
from pathlib import Path

import pytest

from busflow.cli import main
from busflow.node.context import Rng
from busflow.wire.client.client import join
from busflow.wire.client.runs import ask_runs
from tests.processes.conftest import NODES

PATIENCE_S = 60.0

THREE = """
processes:
  left:
  right:
nodes:
  source:
    plugin: source
    process: left
    parameters: {at_start: 500}
  sink:
    plugin: sink
    process: right
    parameters: {enough: 500}
    subscriptions: {numbers: {depth: 1000}}
  here:
    plugin: sink
    parameters: {enough: 500}
    subscriptions: {numbers: {depth: 1000}}
"""


def test_ctrl_c_ends_every_process_in_order(start, have_ended):
    run = start(THREE, "--processes", "auto", "-v", "--watchdog", "off", "--seed", "7")
    run.wait_for("received enough", times=2)
    each_process_is_a_new_interpreter_and_no_fork(run)
    pids = [*run.pids().values()]
    assert len(pids) == 3
    assert run.end() == 130
    assert have_ended(pids, 0)
    told = run.log()
    assert {each["level"] for each in told} == {"debug", "info"}, told
    (drawn,) = [each["number"] for each in run.log() if each["event"] == "draws"]
    assert drawn == int(Rng(7, "/source").integers(1 << 30))
    topic = run.topic("/numbers")
    assert topic["published"] == 500
    assert {(line["node"], line["published"], line["delivered"]) for line in topic["subscriptions"]} == {
        ("/sink", 500, 500),
        ("/here", 500, 500),
    }
    nodes = [(node["name"], node["state"]) for node in run.report()["nodes"]]
    assert nodes == [("/source", "stopped"), ("/sink", "stopped"), ("/here", "stopped")]


def each_process_is_a_new_interpreter_and_no_fork(run):
    for process, pid in run.pids().items():
        command = Path(f"/proc/{pid}/cmdline").read_text().split("\0")
        assert command[command.index("busflow.processes.worker") + 1] == process
        assert Path(f"/proc/{pid}/exe").samefile(f"/proc/{run.process.pid}/exe")
        assert os.getpgid(pid) == pid


STEADY = """
processes:
  left: {restart: POLICY}
  right:
nodes:
  source:
    plugin: source
    process: left
    parameters: {rate_hz: 100}
  sink:
    plugin: sink
    process: right
    parameters: {enough: 20}
  here:
    plugin: sink
    parameters: {enough: 20}
"""


def test_dead_process_is_restarted(start):
    run = start(STEADY.replace("POLICY", "on-failure"), "-v")
    run.wait_for("received enough", times=2)
    run.kill("left")
    run.wait_for("the process left was ended by SIGKILL")
    run.wait_for("begins anew", times=2)
    assert run.end() == 130
    report = run.report()
    (left,) = [each for each in report["processes"] if each["name"] == "left"]
    assert left["restarts"] == 1
    assert len(left["fates"]) == 1
    topic = run.topic("/numbers")
    for line in topic["subscriptions"]:
        assert line["published"] == line["delivered"] + line["dropped"] + line["queued"]
        # Of the life that was killed the last half second is not known; of the other one everything is.
        assert line["published"] > 20


@pytest.mark.long
def test_each_message_past_a_dead_receiver_counts(start):
    run = start(STEADY.replace("POLICY", "never").replace("right:", "right: {restart: on-failure}"), "-v")
    run.wait_for("received enough", times=2)
    run.kill("right")
    run.wait_for("received enough", times=3)
    assert run.end() == 130
    topic = run.topic("/numbers")
    assert {line["node"]: line["published"] for line in topic["subscriptions"]} == {
        "/sink": topic["published"],
        "/here": topic["published"],
    }
    away = {line["node"]: line["drops"].get("unmatched", 0) for line in topic["subscriptions"]}
    assert away["/sink"] > away["/here"]
    assert sum("never reached /sink" in text for text in run.printed) == 1


@pytest.mark.long
def test_hung_process_is_restarted_with_its_parameters(start, monkeypatch, capsys):
    run = start(STEADY.replace("POLICY", "on-failure"), "-v")
    run.wait_for("received enough", times=2)
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
    with join() as peer:
        (answer,) = peer.ask("set_parameters", node="/source", values={"rate_hz": 200.0})
        assert [each["name"] for each in answer["changed"]] == ["rate_hz"]
        run.kill("left", signal.SIGSTOP)
        run.wait_for("the process left", "hangs")
        run.wait_for("begins anew", times=2)
        told = {
            each["name"]: each
            for answer in peer.ask("parameters", node="/source")
            for each in answer.get("/source", ())
        }
    assert (told["rate_hz"]["value"], told["rate_hz"]["source"]) == (200.0, "set at run time")
    assert told["at_start"]["source"] == "default"
    all_is_one_graph()
    main(["doctor", "--json"])
    assert "process-restarted" in [each["code"] for each in json.loads(capsys.readouterr().out)["findings"]]
    assert run.end() == 130
    draws = [each["number"] for each in run.log() if each["event"] == "draws"]
    assert len(draws) == len(set(draws)) == 2, "as a node that is restarted draws other numbers"
    (node,) = [each for each in run.report()["nodes"] if each["name"] == "/source"]
    assert node["parameters_set"] == 1


@pytest.mark.long
def test_node_stopped_by_hand_survives_its_process(start, monkeypatch, capsys):
    run = start(STEADY.replace("POLICY", "on-failure").replace("right:", "right: {restart: on-failure}"), "-v")
    run.wait_for("received enough", times=2)
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
    assert main(["node", "stop", "source", "sink"]) == 0
    assert re.findall("(?m)^[^:]+", capsys.readouterr().out) == ["/source", "/sink"]
    with join() as peer:
        run.kill("left")  # at once: the main process knows of the stop already
        run.wait_for("the process left is started", times=2)
        run.wait_for("the process left runs", times=2)
        assert peer.graph().node("/source").details["state"] == "stopped by hand"
        assert peer.graph().topic("/numbers").publishers == ()
    assert main(["node", "start", "source", "sink"]) == 0
    run.wait_for("begins anew", times=1)
    assert run.end() == 130
    draws = [each["number"] for each in run.log() if each["event"] == "draws"]
    assert len(draws) == len(set(draws)) == 2
    for line in run.topic("/numbers")["subscriptions"]:
        assert line["published"] == line["delivered"] + line["dropped"] + line["queued"]
    assert {node["state"] for node in run.report()["nodes"]} == {"stopped"}


@pytest.mark.long
def test_failure_during_stop_elsewhere_fails_the_run(start):
    run = start(
        """
processes: {side: }
nodes:
  stop: {plugin: "faulty:FailsToStop", process: side}
  task: {plugin: "faulty:FailsInTask", process: side}
  printer: {plugin: "faulty:Printer", process: side}
  here: {plugin: sink}
""",
        "--for",
        "0.3s",
    )
    assert run.end(None) == 1
    told = "".join(run.lines)
    for cause in ("the cable is loose", "the wheel is loose"):
        assert cause in told
    assert sum(line.startswith("error: node /") for line in run.lines) == 2
    assert "[side] hello \\x1b[31mred\n" in run.printed
    assert "[side] no end\n" in run.printed
    assert "[side] to the left\n" in run.lines


def all_is_one_graph():
    """To who looks from another terminal, the processes of that run are."""
    (present,) = ask_runs(PATIENCE_S)
    told = {each["process"]: (each["nodes"], each["restarts"]) for each in present.processes}
    assert told == {"main": (1, 0), "left": (1, 1), "right": (1, 0)}
    assert next(iter(present.processes))["process"] == "main"
    with join() as peer:
        graph = peer.graph()
        assert {name: node.details.get("process") for name, node in graph.nodes.items() if not node.hidden} == {
            "/source": "left",
            "/sink": "right",
            "/here": "main",
        }
        assert {end.node for end in graph.topic("numbers").subscriptions} == {"/sink", "/here"}
        asked = peer.call(peer.service("/count"), {}, timeout_s=PATIENCE_S)
        assert asked["success"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--trace", "trace.txt"], "--trace: a trace works only in one process; add --one-process"),
        (["--no-inspect"], "--no-inspect: the processes of a run inspect each other; add --one-process"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_options_for_one_process_are_refused(project, capsys, arguments, told):
    (project / "run.yaml").write_text(f"plugins: [{NODES}]\n{THREE}")
    assert main(["run", str(project / "run.yaml"), *arguments]) in {1, 2}
    assert told in capsys.readouterr().err
