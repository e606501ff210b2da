"""`NetworkSpec`: the addresses that each machine connects to."""

from busflow.launchfile.load.load import load


def test_first_named_of_two_machines_connects(machines):
    network = machines.network
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
