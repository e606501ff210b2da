"""Building the network: addresses, credentials and rights of machines, and their mistakes."""

import pytest

from busflow.launchfile.load.load import examine, load
from busflow.launchfile.model.ros2 import ROUTER, Ros2Transport


def test_listen_address_and_credentials_of_a_machine(machines):
    found = machines.network.machines
    assert {name: each.listen and str(each.listen) for name, each in found.items()} == {
        "main": None,
        "arm": "tls/192.0.2.7:7447",
        "head": "tls/0.0.0.0:7001",
    }
    assert {name: (str(each.cert.path), str(each.key.path)) for name, each in found.items()} == {
        "main": ("certs/main.pem", "certs/main.key"),
        "arm": ("certs/arm.pem", "certs/arm.key"),
        "head": ("keys/h.pem", "certs/head.key"),
    }


@pytest.mark.parametrize(
    ("text", "code", "expected"),
    [
        ("machines: {arm: {connect: 'tcp/192.0.2.7:7447'}}", "open-endpoint", "fix: write tls/192.0.2.7:7447"),
        ("machines: {arm: {connect: 'udp/192.0.2.7:7447'}}", "bad-endpoint", "machines are not linked by udp"),
        ("machines: {arm: {connect: 192.0.2.7}}", "bad-endpoint", "write it as tls/192.0.2.7:7447"),
        ("machines: {arm: {connect: 'tls/192.0.2.7:70000'}}", "bad-endpoint", "a port of 1 to 65535"),
        ("machines: {arm: {connect: 'tls/h:1#ca=/etc/x'}}", "bad-endpoint", "is not an endpoint"),
        ("machines: {arm: {connect: 'tls/0.0.0.0:7447'}}", "bad-endpoint", "no machine can connect to it"),
        ("machines: {arm: {connect: 'tls/arm.local:7447'}}", "no-endpoint", "add listen: tls/0.0.0.0:7447"),
        ("machines: {arm: {}}", "no-endpoint", "no machine can connect to arm"),
        ("machines: {arm: {connect: 'tls/192.0.2.7:7447'}}", "no-certificates", "busflow certs new"),
        ("machines: {a b: {connect: 'tls/192.0.2.7:7447'}}", "invalid-name", "is not a name for a machine"),
        ("network: {ca: ca.pem, allow: {main: read}}", "invalid-name", "main is a machine, which may do all"),
        ("network: {ca: ca.pem, allow: {viewer: write}}", "unknown-choice", "read, all"),
        ("network: {ros2: {router: 'tls/h:7447'}}", "bad-endpoint", "write it as tcp/127.0.0.1:7447"),
        (
            "network: {ros2: {router: 'tcp/0.0.0.0:7447'}}",
            "open-endpoint",
            "any node of ROS 2 that reaches it takes part",
        ),
        ("network: {ros2: {domain: 233}}", "out-of-range", "domain"),
        (
            "network: {ros2: {domain: 0}}\nmachines: {arm: {connect: 'tcp/127.0.0.1:7448'}}",
            "open-endpoint",
            "link the machines by tls",
        ),
        (
            "network: {ros2: {}}\nmachines: {arm: {connect: 'tcp/127.0.0.1:7447'}}",
            "missing-domain",
            "state it: ros2: {domain: 0}",
        ),
        (
            "network: {ros2: {transport: dds, router: 'tcp/127.0.0.1:7447'}}",
            "unused-key",
            "the transport dds has no router",
        ),
        ("network: {ros2: {interface: eth0}}", "unused-key", "the transport zenoh has no interface"),
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


def test_ros2_takes_its_defaults_and_stated_values(folder):
    found = folder.load("network: {ros2: {}}\nnodes: {a: {plugin: p}}\n").ros2
    assert (found.domain, found.transport, found.router, found.topics) == (None, Ros2Transport.ZENOH, ROUTER, ())
    text = "network: {ros2: {domain: 7, router: 'tcp/[::1]:7448', topics: [/imu/*]}}\nnodes: {a: {plugin: p}}\n"
    found = folder.load(text).ros2
    assert (found.domain, str(found.router), found.topics) == (7, "tcp/[::1]:7448", ("/imu/*",))
    assert str(found.origin) == "lab1.yaml:1:11"
    assert folder.load("network: {ca: ca.pem}\nnodes: {a: {plugin: p}}\n").ros2 is None
    found = folder.load("network: {ros2: {transport: dds, interface: eth0}}\nnodes: {a: {plugin: p}}\n").ros2
    assert (found.transport, found.interface) == (Ros2Transport.DDS, "eth0")


def test_a_run_of_one_machine_states_whether_its_processes_use_lines(folder):
    for stated in (True, False):
        found = folder.load(f"network: {{line: {str(stated).lower()}}}\nnodes: {{a: {{plugin: p}}}}\n")
        assert found.line is stated
        assert list(found.network.machines) == ["main"]
