"""Tests of `credentials.py`, `endpoints.py`, `machine.py`, `planned_node.py`, `resolved.py` and `supervision.py`."""

from pathlib import Path

import pytest

from busflow.clock import SystemClock, Time
from busflow.errors import LaunchError, Severity
from busflow.launchfile.load.load import load
from busflow.launchfile.model.placement import placed
from busflow.launchfile.yaml.block import lines, origins, text_of
from busflow.launchfile.yaml.value import Origin, StatedBy, StatedPath
from busflow.runner.planning.credentials import credential_faults
from busflow.runner.planning.machine import on_machine
from busflow.runner.planning.resolved import resolve
from busflow.wire.machines.certificates import Authority

BASE = "plugins: [plugins]\nnodes:\n  talker: {plugin: talker}\n  listener: {plugin: listener}\n"


def test_strict_makes_unmatched_subscription_an_error(check):
    text = BASE.replace("  talker: {plugin: talker}\n", "")
    assert check(text).errors == []
    assert [problem.code for problem in check(text, strict=True).errors] == ["nobody-publishes"]


def test_unmatched_publisher_is_only_information(check):
    plan = check(BASE.replace("  listener: {plugin: listener}\n", ""))
    assert [(problem.code, problem.severity) for problem in plan.problems] == [("nobody-receives", Severity.INFO)]


@pytest.mark.parametrize("node", ["  talker: {plugin: talker}\n", "  listener: {plugin: listener}\n"])
def test_external_topic_needs_no_counterpart(check, node):
    text = BASE.replace(node, "") + "topics: {/numbers: {external: true}}\n"
    assert check(text, strict=True).problems == []


def test_external_topic_without_endpoint_is_unknown(check):
    plan = check(BASE + "topics: {/numbrs: {external: true}}\n")
    assert [(each.code, each.fix) for each in plan.problems] == [("unknown-topic", "did you mean '/numbers'?")]


def test_topics_of_two_namespaces_are_distinct(check):
    plan = check("plugins: [plugins]\nnodes:\n  left/talker: {plugin: talker}\n  right/listener: {plugin: listener}\n")
    assert plan.nodes[0].publishers[0].topic == "/left/numbers"
    assert any("receives /right/numbers" in problem.message for problem in plan.problems)


@pytest.mark.parametrize(
    ("machine", "here", "elsewhere"),
    [
        (
            None,
            {"main": ("/planner",), "ears": ("/listener",)},
            {"arm:main": ("/motor",), "head:eyes": ("/camera",)},
        ),
        (
            "head",
            {"head:main": (), "head:eyes": ("/camera",)},
            {"arm:main": ("/motor",), "main": ("/planner",), "ears": ("/listener",)},
        ),
    ],
)
def test_every_node_is_on_one_machine(machines, monkeypatch, machine, here, elsewhere):
    monkeypatch.setattr("busflow.runner.planning.machine.credential_problems", lambda *_: ())
    placement = placed(on_machine(machines, machine, together=False))
    assert placement.nodes == here
    assert placement.elsewhere == elsewhere
    for process, nodes in {**here, **elsewhere}.items():
        assert [placement.process_of(node) for node in nodes] == [process] * len(nodes)


def test_unknown_machine_is_refused_with_a_suggestion(machines, golden):
    with golden.raises(LaunchError):
        on_machine(machines, "arn", together=False)


def test_machine_is_refused_where_all_runs_together(machines, golden):
    assert on_machine(machines, None, together=True).here is None
    with golden.raises(LaunchError):
        on_machine(machines, "arm", together=True)


def faults_of(folder: Path, name: str, hosts: list[str], now: Time | None = None) -> list[str]:
    """Return the codes of the problems with the credentials in a folder."""
    ca, cert, key = (
        StatedPath(folder / each, Origin(StatedBy.CALLER)) for each in ("ca.pem", f"{name}.pem", f"{name}.key")
    )
    return [each.code for each in credential_faults(name, (ca, cert, key), hosts, now or SystemClock().now())]


def test_credential_faults_are_found_before_a_connection(tmp_path):
    authority = Authority.new(tmp_path / "certs")
    made = authority.add("arm", addresses=["192.0.2.7"])
    assert faults_of(authority.folder, "arm", ["192.0.2.7"]) == []
    assert faults_of(authority.folder, "arm", ["192.0.2.8"]) == ["other-host"]
    assert faults_of(authority.folder, "head", []) == ["missing-file", "missing-file"]
    assert "expires-soon" in faults_of(authority.folder, "arm", [], Time(SystemClock().now().nanoseconds * 3))
    made.key.chmod(0o640)
    assert faults_of(authority.folder, "arm", []) == ["open-key"]


def test_dependencies_that_can_never_be_met_are_errors(check):
    circle = check(
        BASE + "  a: {plugin: talker, depends_on: {b: ready}}\n  b: {plugin: talker, depends_on: {a: ready}}\n"
    )
    assert [problem.code for problem in circle.errors] == ["dependency-cycle"]
    silent = check(BASE + "  a: {plugin: talker, depends_on: {listener: first_message}}\n")
    assert [problem.code for problem in silent.errors] == ["no-publisher"]


def test_planned_node_reports_at_its_launch_file_entry(check):
    talker, listener = check(BASE).nodes
    assert [each.topic for each in talker.publishers] == [each.topic for each in listener.subscriptions] == ["/numbers"]
    assert (talker.servers, talker.clients) == ([], [])
    assert str(listener.problem("code", "message", None).place) == "lab1.yaml:4:3"


def test_resolved_file_names_each_origin_and_loads_again(check, folder):
    check("plugins: [plugins]\nnodes: {talker: {plugin: talker, parameters: {rate_hz: 5.0}}}\n")
    found = resolve(load("lab1.yaml", environment={}))
    assert origins(found)["nodes.talker.parameters.rate_hz"] == "lab1.yaml:2:56"
    assert any(line.endswith("# from lab1.yaml:2:56") for line in lines(found))
    folder.write(text_of(found), "again.yaml")
    assert load("again.yaml", environment={}).nodes[0].parameters.data["rate_hz"] == 5.0
