"""Builds the `NetworkSpec` of a launch file, and checks every address and every name."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from busflow.launchfile.model.keys import LaunchKeys
from busflow.launchfile.model.network import NAME, TCP, TLS, MachineSpec, NetworkAddress, NetworkSpec, Role
from busflow.launchfile.model.placement import MAIN
from busflow.launchfile.model.problems import Problems, key_origin, problem_at, warning_at
from busflow.launchfile.model.ros2 import ROUTER, Ros2Spec, Ros2Transport
from busflow.launchfile.yaml.value import Origin, StatedPath, Value
from busflow.text import did_you_mean

_ENDPOINT = re.compile(
    r"(?P<protocol>[a-z][a-z0-9_-]*)/(?P<host>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+):(?P<port>[0-9]{1,5})"
)
_MOST_PORT = 65_535


def anchored(tree: Value, folder: Path) -> Value:
    """Return the keys of a file with the paths of certificates and packages joined to the file's folder."""
    machines = (("machines", name, word) for name in tree.section("machines") for word in ("cert", "key"))
    packages = (("packages", name) for name in tree.section("packages"))
    for path in (("network", "ca"), ("network", "cert"), ("network", "key"), *machines, *packages):
        value = tree.find(path)
        if value is not None and isinstance(value.content, str) and value.content:
            target = os.path.normpath(folder / Path(value.content).expanduser())
            tree = tree.with_member(path, replace(value, content=target))
    return tree


def network_of(keys: LaunchKeys, tree: Value, problems: Problems) -> NetworkSpec | None:
    """Return the network that a launch file describes; None if it describes none."""
    if not keys.machines and "network" not in tree.members:
        return None
    return _Builder(keys, tree, problems).build()


def ros2_of(keys: LaunchKeys, tree: Value, network: NetworkSpec | None, problems: Problems) -> Ros2Spec | None:
    """Return how nodes of ROS 2 reach the run; None if the launch file does not say that they may."""
    stated, value = keys.network.ros2, tree.find(("network", "ros2"))
    if stated is None or value is None:
        return None
    origin = key_origin(value)
    if keys.machines and stated.domain is None:
        text = "each machine of the run would take the domain of its own environment"
        problems.add(problem_at("missing-domain", text, "state it: ros2: {domain: 0}", origin))
    if network is not None and any(end.protocol == TCP for end in network.ends):
        text = "machines linked by tcp cannot be told from nodes of ROS 2"
        problems.add(problem_at("open-endpoint", text, "link the machines by tls", origin))
    other = "router" if stated.transport is Ros2Transport.DDS else "interface"
    if (unused := tree.find(("network", "ros2", other))) is not None and unused.content is not None:
        text = f"the transport {stated.transport} has no {other}"
        problems.add(problem_at("unused-key", text, f"leave out {other}, or take the other transport", unused.origin))
    router = _router(tree.find(("network", "ros2", "router")), problems)
    return Ros2Spec(stated.domain, stated.transport, router, stated.interface, tuple(stated.topics), origin)


def _router(stated: Value | None, problems: Problems) -> NetworkAddress:
    """Return where nodes of ROS 2 meet, and warn of an address at which other machines reach the run."""
    if stated is None or not isinstance(stated.content, str):
        return ROUTER
    address = _address(stated)
    if address is None or address.protocol != TCP:
        fix = f"write it as {ROUTER}, a port of 1 to 65535"
        problems.add(problem_at("bad-endpoint", f"{stated.content} is not the address of a router", fix, stated.origin))
        return ROUTER
    if not address.is_loopback:
        text = f"{address} is not of this machine alone: any node of ROS 2 that reaches it takes part"
        fix = "it asks for no password: name it only in a network of your own"
        problems.add(warning_at("open-endpoint", text, fix, stated.origin))
    return address


def _address(stated: Value) -> NetworkAddress | None:
    """Return a network address as it is written; None if it is not valid."""
    found = _ENDPOINT.fullmatch(str(stated.content))
    if found is None or not 0 < int(found["port"]) <= _MOST_PORT:
        return None
    return NetworkAddress(found["protocol"], found["host"].strip("[]"), int(found["port"]), stated.origin)


class _Builder:
    """Builds the network and collects its problems."""

    def __init__(self, keys: LaunchKeys, tree: Value, problems: Problems) -> None:
        self._keys, self._tree, self._problems = keys, tree, problems

    def build(self) -> NetworkSpec:
        """Return the network without its wrong parts."""
        stated = self._tree.section("machines")
        listen = self._endpoint(("network", "listen"))
        ca = self._file(("network", "ca"))
        names = [MAIN, *(name for name in stated if name != MAIN)]
        machines = {
            name: self._machine(name, listen, ca) for name in names if name == MAIN or self._is_name(name, stated[name])
        }
        network = NetworkSpec(machines, ca, self._allowed(machines))
        self._check_ways(network)
        return network

    def _machine(self, name: str, listen: NetworkAddress | None, ca: StatedPath | None) -> MachineSpec:
        at = ("machines", name)
        value = self._tree.find(at)
        connect = self._endpoint((*at, "connect"))
        own = self._endpoint((*at, "listen")) or listen
        if own is None and connect is not None:
            own = connect if connect.is_address else None
            if own is None:
                fix = f"add listen: {connect.protocol}/0.0.0.0:{connect.port} to network, or to the machine"
                text = f"{connect.host} is a name: it does not say on which addresses {name} is to listen"
                self._report("no-endpoint", text, fix, connect.origin)
        if connect is not None and connect.is_everywhere:
            text = f"{connect} stands for all addresses of a machine: no machine can connect to it"
            self._report("bad-endpoint", text, f"write it below listen, and here the address of {name}", connect.origin)
            connect = None
        origin = key_origin(value) if value is not None else key_origin(self._tree)
        cert, key = (self._credential(name, word, ca) for word in ("cert", "key"))
        return MachineSpec(name, origin, connect, own, cert, key)

    def _credential(self, name: str, word: str, ca: StatedPath | None) -> StatedPath | None:
        """Return the certificate or key of a machine: its own, the network's, or the file of its name beside `ca`."""
        found = self._file(("machines", name, word)) or self._file(("network", word))
        if found is None and ca is not None:
            suffix = ".pem" if word == "cert" else ".key"
            found = StatedPath(ca.path.with_name(f"{name}{suffix}"), ca.origin)
        return found

    def _allowed(self, machines: Mapping[str, MachineSpec]) -> dict[str, Role]:
        stated = self._tree.find(("network", "allow"))
        found: dict[str, Role] = {}
        for name, value in stated.members.items() if stated is not None else ():
            if name in machines:
                text, fix = f"{name} is a machine, which may do all", "leave it out, or choose another name"
                self._report("invalid-name", text, fix, key_origin(value))
            elif self._is_name(name, value):
                found[name] = self._keys.network.allow[name]
        return found

    def _check_ways(self, network: NetworkSpec) -> None:
        """Check that every machine can be linked to the main one, and that certificates are given where needed."""
        main = network.machines[MAIN]
        for machine in network.machines.values():
            if machine.connect is None and main.connect is None and machine is not main:
                fix = f"add connect: tls/HOST:7447, where {machine.name} is reached"
                self._report("no-endpoint", f"no machine can connect to {machine.name}", fix, machine.origin)
        encrypted = next((end for end in network.ends if end.protocol == TLS), None)
        if encrypted is not None and network.ca is None:
            fix = "add network: {ca: certs/ca.pem}; `busflow certs new certs` makes one"
            self._report("no-certificates", f"{encrypted} needs certificates", fix, encrypted.origin)

    def _endpoint(self, path: tuple[str, ...]) -> NetworkAddress | None:
        """Return the network address stated at a path; None, and a problem, if it is not allowed."""
        value = self._tree.find(path)
        if value is None or not isinstance(value.content, str):
            return None
        text, end = value.content, _address(value)
        if end is None:
            message = f"{text} is not an endpoint"
            self._report("bad-endpoint", message, "write it as tls/192.0.2.7:7447, a port of 1 to 65535", value.origin)
            return None
        there = f"{TLS}/{text.partition('/')[2]}"
        if end.protocol not in {TLS, TCP}:
            self._report("bad-endpoint", f"machines are not linked by {end.protocol}", f"write {there}", value.origin)
            return None
        if end.protocol == TCP and not end.is_loopback:
            message = f"{text} is unencrypted and open to everyone: anyone who reaches it could move the robot"
            fix = f"write {there}; `busflow certs new certs` makes the certificates"
            self._report("open-endpoint", message, fix, value.origin)
            return None
        return end

    def _file(self, path: tuple[str, ...]) -> StatedPath | None:
        value = self._tree.find(path)
        stated = value is not None and isinstance(value.content, str) and value.content
        return StatedPath(Path(str(value.content)), value.origin) if value is not None and stated else None

    def _is_name(self, name: str, value: Value) -> bool:
        if NAME.fullmatch(name):
            return True
        message = f"{name!r} is not a name for a machine or a certificate"
        fix = "it is made of up to 32 letters, digits, _ and -, a letter first"
        self._report("invalid-name", message, fix, key_origin(value))
        return False

    def _report(self, code: str, message: str, fix: str, origin: Origin) -> None:
        self._problems.add(problem_at(code, message, fix, origin))


def unknown_machine(name: str, known: Mapping[str, object]) -> tuple[str, str]:
    """Return message and fix for an unknown machine."""
    fix = f"{did_you_mean(name, [MAIN, *known])}; or add it: machines: {{{name}: {{connect: tls/HOST:7447}}}}"
    return f"there is no machine {name}", fix
