"""The machines of a launch file: where each is reached, who connects to whom, and what is expected of mistakes."""

import pytest

from busflow.launchfile.check.machine import on_machine
from busflow.launchfile.load.load import examine, load
from busflow.launchfile.model.placement import placed

FILE = """
machines:
  arm: {connect: "tls/192.0.2.7:7447"}
  head: {connect: "tls/[2001:db8::1]:7447", listen: "tls/0.0.0.0:7001", cert: keys/h.pem}
network: {ca: certs/ca.pem, allow: {viewer: read, boss: all}}
processes:
  eyes: {machine: head}
  ears:
nodes:
  camera: {plugin: p, process: eyes}
  motor: {plugin: p, machine: arm}
  planner: {plugin: p}
  listener: {plugin: p, process: ears}
"""


@pytest.fixture
def described(folder):
    folder.write(FILE)
    return load("lab1.yaml")


def test_first_named_of_two_machines_connects(described):
    network = described.network
    dialled = {name: [str(end) for end in network.dialled_by(name)] for name in network.machines}
    assert dialled == {
        "main": ["tls/192.0.2.7:7447", "tls/[2001:db8::1]:7447"],
        "arm": ["tls/[2001:db8::1]:7447"],
        "head": [],
    }


def test_unreachable_machine_connects_itself(folder):
    folder.write(
        "machines: {main: {connect: 'tls/192.0.2.1:7447'}, arm: {}}\nnetwork: {ca: c/ca.pem}\n"
        "nodes: {a: {plugin: p, machine: arm}, b: {plugin: p}}\n"
    )
    network = load("lab1.yaml").network
    assert [str(end) for end in network.dialled_by("arm")] == ["tls/192.0.2.1:7447"]
    assert network.dialled_by("main") == []


def test_listen_address_and_credentials_of_a_machine(described):
    machines = described.network.machines
    assert {name: each.listen and str(each.listen) for name, each in machines.items()} == {
        "main": None,
        "arm": "tls/192.0.2.7:7447",
        "head": "tls/0.0.0.0:7001",
    }
    assert {name: (str(each.cert.path), str(each.key.path)) for name, each in machines.items()} == {
        "main": ("certs/main.pem", "certs/main.key"),
        "arm": ("certs/arm.pem", "certs/arm.key"),
        "head": ("keys/h.pem", "certs/head.key"),
    }


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
def test_every_node_is_on_one_machine(described, monkeypatch, machine, here, elsewhere):
    monkeypatch.setattr("busflow.launchfile.check.machine.credential_problems", lambda *_: ())
    placement = placed(on_machine(described, machine, together=False))
    assert placement.nodes == here
    assert placement.elsewhere == elsewhere
    for process, nodes in {**here, **elsewhere}.items():
        assert [placement.process_of(node) for node in nodes] == [process] * len(nodes)


@pytest.mark.parametrize(
    ("text", "code", "expected"),
    [
        ("machines: {arm: {connect: 'tcp/192.0.2.7:7447'}}", "open-endpoint", "fix: write tls/192.0.2.7:7447"),
        ("machines: {arm: {connect: 'udp/192.0.2.7:7447'}}", "bad-endpoint", "machines are not linked by udp"),
        ("machines: {arm: {connect: 192.0.2.7}}", "bad-endpoint", "write it as tls/192.0.2.7:7447"),
        ("machines: {arm: {connect: 'tls/192.0.2.7:70000'}}", "bad-endpoint", "a port of 1 to 65535"),
        ("machines: {arm: {connect: 'tls/h:1#ca=/etc/x'}}", "bad-endpoint", "is no endpoint"),
        ("machines: {arm: {connect: 'tls/0.0.0.0:7447'}}", "bad-endpoint", "nobody can connect to it"),
        ("machines: {arm: {connect: 'tls/arm.local:7447'}}", "no-endpoint", "add listen: tls/0.0.0.0:7447"),
        ("machines: {arm: {}}", "no-endpoint", "nobody can connect to the machine arm"),
        ("machines: {arm: {connect: 'tls/192.0.2.7:7447'}}", "no-certificates", "busflow certs new"),
        ("machines: {a b: {connect: 'tls/192.0.2.7:7447'}}", "invalid-name", "is no name of a machine"),
        ("network: {ca: ca.pem, allow: {main: read}}", "invalid-name", "main is a machine, which may do all"),
        ("network: {ca: ca.pem, allow: {viewer: write}}", "unknown-choice", "read, all"),
        ("nodes: {b: {plugin: p, machine: amr}}", "unknown-machine", "there is no machine amr"),
        ("processes: {x: {machine: amr}}", "unknown-machine", "there is no machine amr"),
        (
            (
                "machines: {arm: {connect: 'tcp/127.0.0.1:7447'}}\nprocesses: {x: {}}\n"
                "nodes: {b: {plugin: p, machine: arm, process: x}}"
            ),
            "other-machine",
            "write machine: arm below processes: x",
        ),
    ],
)
def test_network_mistake_is_reported_with_its_fix(folder, text, code, expected):
    folder.write(f"{text}\n" + ("" if "nodes:" in text else "nodes: {a: {plugin: p}}\n"))
    _, problems = examine("lab1.yaml")
    found = [problem for problem in problems if problem.code == code]
    assert found, [problem.render() for problem in problems]
    assert expected in "\n".join(problem.render() for problem in found)
    assert found[0].place is not None


def test_paths_are_relative_to_the_included_file(folder):
    folder.write("network: {ca: keys/ca.pem, listen: 'tls/0.0.0.0:7447'}\n", "robots/net.yaml")
    folder.write("include: robots/net.yaml\nnodes: {a: {plugin: p}}\n")
    assert str(load("lab1.yaml").network.ca.path) == "robots/keys/ca.pem"
