"""Router: where the sessions of `rmw_zenoh` on this machine meet, which is a router of ROS 2 or the run itself.

A session of ROS 2 connects to `tcp/localhost:7447`, where `ros2 run rmw_zenoh_cpp rmw_zenohd` listens. Where nothing
does, the run's main process does. Sessions find each other there, and then link directly.
"""

from __future__ import annotations

import os
import socket
from contextlib import closing
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.errors import InspectionUnavailable
from busflow.launchfile.model.ros2 import Ros2Spec, Ros2Transport
from busflow.ros2.port_owner import owner_of
from busflow.wire.zenoh.held_port import HeldPort
from busflow.wire.zenoh.network import Network, Ros2Network
from busflow.wire.zenoh.run_directory import runs
from busflow.wire.zenoh.session import open_remote, require_zenoh

if TYPE_CHECKING:
    from busflow.launchfile.model.network import NetworkAddress


def with_ros2(spec: Ros2Spec, linked: Network | None) -> Network | None:
    """Return the network of a run's main process, with its nodes of ROS 2 if they come over Zenoh.

    Raises:
        InspectionUnavailable: the port of ROS 2's router belongs to something else.
        LaunchError: the environment names no valid domain.
    """
    if spec.transport is not Ros2Transport.ZENOH:
        return linked
    return replace(linked or Network(()), ros2=_ros2_network(spec))


def _ros2_network(spec: Ros2Spec) -> Ros2Network:
    """Find out where the nodes of ROS 2 on this machine meet.

    Raises:
        InspectionUnavailable: the port of their router belongs to something else.
        LaunchError: the environment names no valid domain.
    """
    require_zenoh()
    domain, router = spec.domain_in(os.environ), spec.router
    if router.is_everywhere:
        router = replace(router, host="localhost")
    if not _is_taken(router):
        return Ros2Network(domain, spec.topics, listens=(str(spec.router),), is_router=True)
    _require_router(router)
    # Sessions of runs do not connect by themselves, and no router carries messages between two of its peers.
    others = (address for run in runs() if run.card.ros2_domain == domain for address in run.card.ros2_addresses)
    with closing(HeldPort()) as port:
        return Ros2Network(domain, spec.topics, listens=(port.address,), dials=(str(router), *others))


def _is_taken(address: NetworkAddress) -> bool:
    try:
        with socket.create_connection((address.host, address.port), timeout=timeouts.current.router):
            return True
    except OSError:
        return False


def _require_router(address: NetworkAddress) -> None:
    """Check that a Zenoh router listens at an address.

    Raises:
        InspectionUnavailable: something else does.
    """
    try:
        session: Any = open_remote(Network((address,)), patience_s=timeouts.current.router)
    except InspectionUnavailable:
        found = "no Zenoh router"
    else:
        try:
            if list(session.info.routers_zid()):
                return
            found = "a Zenoh session, and no router"
        finally:
            session.close()
    fix = f"end {owner_of(address.port) or 'it'}, or name another place: network: {{ros2: {{router: tcp/HOST:PORT}}}}"
    raise InspectionUnavailable(f"nodes of ROS 2 meet at {address}, and what listens there is {found}: {fix}")
