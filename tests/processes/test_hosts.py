"""Two hosts with a cable between them: network namespaces, where the system lets this user make them."""

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from busflow.wire.machines.certificates import Authority


class Hosts:
    """Two of them, with a cable."""

    def __init__(self) -> None:
        self.names = {"main": f"bf{os.getpid()}a", "arm": f"bf{os.getpid()}b"}
        self._addresses = {"main": "10.99.0.1", "arm": "10.99.0.2"}

    def make(self) -> None:
        near, far = self.names.values()
        for name in self.names.values():
            ip("netns", "add", name)
        ip("link", "add", near, "type", "veth", "peer", "name", far, "netns", far)
        ip("link", "set", near, "netns", near)
        for machine, name in self.names.items():
            ip("-n", name, "addr", "add", f"{self._addresses[machine]}/24", "dev", name)
            ip("-n", name, "link", "set", name, "up")
            ip("-n", name, "link", "set", "lo", "up")

    def cable(self, state: str) -> None:
        """Pull it out, or plug it in again: `down` or `up`."""
        name = self.names["arm"]
        ip("-n", name, "link", "set", name, state)

    def remove(self) -> None:
        for name in self.names.values():
            subprocess.run(["ip", "netns", "del", name], capture_output=True)

    def on(self, machine: str) -> list[str]:
        return ["ip", "netns", "exec", self.names[machine]]


def ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, capture_output=True, timeout=60)


@pytest.fixture
def hosts() -> Iterator[Hosts]:
    if shutil.which("ip") is None:
        pytest.skip("there is no `ip` here to make network namespaces with")
    found = Hosts()
    try:
        found.make()
    except (subprocess.CalledProcessError, OSError) as error:
        found.remove()
        pytest.skip(f"this user cannot make network namespaces here: {error}")
    yield found
    found.remove()


@pytest.fixture
def file(tmp_path: Path) -> str:
    folder = tmp_path / "certs"
    authority = Authority.new(folder)
    authority.add("main")
    authority.add("arm", addresses=["10.99.0.2"])
    return """
machines:
  arm: {connect: tls/10.99.0.2:7447}
network: {ca: certs/ca.pem}
nodes:
  source: {plugin: source, parameters: {rate_hz: 50}}
  sink:
    plugin: sink
    machine: arm
    parameters: {enough: 20}
    subscriptions: {numbers: {depth: 1000}}
"""


@pytest.mark.long
def test_link_recovers_after_a_pulled_cable(start: Callable, file: str, hosts: Hosts):
    arm = start(file, machine="arm", prefix=hosts.on("arm"))
    main = start(file, machine="main", prefix=hosts.on("main"))
    arm.wait_for("received enough")
    assert listening(hosts, "main") == [], "nothing listens that the launch file does not name"
    (only,) = listening(hosts, "arm")
    assert "10.99.0.2:7447" in only
    hosts.cable("down")
    main.wait_for("the machine arm is not linked any more")
    arm.wait_for("the machine main is not linked any more")
    main.wait_for("the machine arm is not linked: tls/10.99.0.2:7447 ")
    hosts.cable("up")
    for run, other in ((main, "arm"), (arm, "main")):
        run.wait_for(f"the machine {other} is linked again")
    assert "data: " in arm.busflow("topic", "echo", "numbers", "--once"), "a terminal needs no cable to its own run"
    assert main.end() == arm.end() == 130
    topic = arm.topic("/numbers")
    (line,) = topic["subscriptions"]
    assert line["published"] == line["delivered"] + line["dropped"] + line["queued"]
    assert topic["losses"]["lost"] > 0
    missed = main.topic("/numbers")["published"] - line["published"] - topic["losses"]["lost"]
    assert missed >= 0, "the rest was published before the arm listened, or when the run ended"


def listening(hosts: Hosts, machine: str) -> list[str]:
    command = [*hosts.on(machine), "ss", "-Htuln"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
