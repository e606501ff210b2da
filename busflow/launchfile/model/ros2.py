"""`Ros2Spec`: how nodes of ROS 2 reach a run, as a launch file or `--ros2` says."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from busflow.errors import LaunchError, Problem
from busflow.launchfile.model.network import TCP, NetworkAddress
from busflow.launchfile.yaml.value import Origin, StatedBy

MOST_DOMAIN = 232
"""The highest domain of ROS 2: DDS makes port numbers of domains, and this one has the last."""
VARIABLE = "ROS_DOMAIN_ID"
ROUTER = NetworkAddress(TCP, "127.0.0.1", 7447, Origin(StatedBy.DEFAULT))
"""Where a session of `rmw_zenoh` looks for a router by default."""


class Ros2Transport(StrEnum):
    """The middleware of ROS 2 that is spoken."""

    ZENOH = "zenoh"
    """That of `rmw_zenoh`."""
    DDS = "dds"
    """That of `rmw_cyclonedds` and, for topics, of `rmw_fastrtps`."""


@dataclass(frozen=True, slots=True)
class Ros2Spec:
    """The domain that is joined, the middleware, and what passes between the run and its nodes of ROS 2."""

    domain: int | None = None  # None: that of ROS_DOMAIN_ID, else 0
    transport: Ros2Transport = Ros2Transport.ZENOH
    router: NetworkAddress = ROUTER  # where the sessions of ROS 2 meet, over Zenoh
    interface: str | None = None  # the network interface, over DDS; None: the loopback interface
    topics: tuple[str, ...] = ()  # patterns of topics and services; empty: all
    origin: Origin | None = None  # its `place` is the key; None: the command line's option

    def domain_in(self, environment: Mapping[str, str]) -> int:
        """Return the domain in this environment.

        Raises:
            LaunchError: the variable ROS_DOMAIN_ID has no domain.

        >>> Ros2Spec().domain_in({"ROS_DOMAIN_ID": "7"}), Ros2Spec(3).domain_in({"ROS_DOMAIN_ID": "7"})
        (7, 3)
        """
        stated = environment.get(VARIABLE, "")
        if self.domain is not None or not stated:
            return self.domain or 0
        if re.fullmatch("[0-9]{1,3}", stated) and int(stated) <= MOST_DOMAIN:
            return int(stated)
        fix = f"set a number from 0 to {MOST_DOMAIN}, unset it, or state network: {{ros2: {{domain: 0}}}}"
        text = f"{VARIABLE} is {stated[:40]!r}, which is not a domain of ROS 2"
        raise LaunchError([Problem("bad-domain", text, fix, self.origin.place if self.origin else None)])
