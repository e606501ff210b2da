"""`neighbours`: the nodes of ROS 2 in a run's graph, by machine, as far as the run's links show it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from ipaddress import ip_address
from typing import Any

from busflow.bus.names import is_hidden
from busflow.errors import Problem, Severity
from busflow.text import counted, printable
from busflow.wire.zenoh.keys import Token, TokenKind

HERE = "this machine"
BEYOND = "beyond a router"
"""Where a node is to which the run has no link of its own: another session forwards its messages."""
_MOST_NAMES = 5


def neighbours(tokens: Iterable[Token], answers: Iterable[Mapping[str, Any]]) -> Mapping[str, Sequence[str]]:
    """Return the names of the nodes that are not of the run, by host.

    Args:
        tokens: every token of the graph.
        answers: each process's answer to `graph`; a process of a run without ROS 2 states no links.
    """
    own, hosts = set[str](), dict[str, str]()
    for links in (dict(answer["links"]) for answer in answers if "links" in answer):
        own.add(links.pop("", ""))
        hosts |= {session: _host(address) for session, address in links.items()}
    found: dict[str, list[str]] = {}
    for token in tokens if own else ():
        if token.kind is TokenKind.NODE and token.session not in own and not is_hidden(token.node_name):
            found.setdefault(hosts.get(token.session, BEYOND), []).append(printable(token.node_name))
    return {host: sorted(names) for host, names in sorted(found.items())}


def shown(found: Mapping[str, Sequence[str]]) -> str:
    """Return the nodes of each host in words.

    >>> shown({"this machine": ["/camera", "/rviz"], "192.0.2.7": ["/arm"]})
    '/camera, /rviz (this machine); /arm (192.0.2.7)'
    """
    return "; ".join(f"{_names(names)} ({host})" for host, names in found.items())


def strangers(found: Mapping[str, Sequence[str]], domain: int) -> Iterator[Problem]:
    """Yield a finding where nodes are not of this machine: they may be of another robot in the same domain."""
    for host, names in found.items():
        if host != HERE:
            text = f"domain {domain} of ROS 2 has {counted(len(names), 'node')} {_at(host)}: {_names(names)}"
            fix = "if they are not yours, take another domain: network: {ros2: {domain: 7}}, or ROS_DOMAIN_ID"
            yield Problem("foreign-nodes", text, fix, severity=Severity.WARNING)


def crowds(answers: Iterable[Mapping[str, Any]]) -> Iterator[Problem]:
    """Yield a finding where other sessions show more than a process takes in: their further nodes are not seen."""
    ignored = max((answer.get("ignored_tokens", 0) for answer in answers), default=0)
    if ignored:
        text = f"other sessions show too many nodes and endpoints: {ignored:,} times one was ignored"
        fix = "end the program that shows them, or name the topics that may pass: network: {ros2: {topics: [...]}}"
        yield Problem("tokens-ignored", text, fix, severity=Severity.WARNING)


def _at(host: str) -> str:
    return host if host == BEYOND else f"at {host}"


def _host(address: str) -> str:
    """Return the host in an address of Zenoh.

    >>> [_host(each) for each in ("tcp/192.0.2.7:7447", "tcp/[::1]:7447", "unixsock-stream//run/main.sock")]
    ['192.0.2.7', 'this machine', 'this machine']
    """
    protocol, _, rest = address.partition("/")
    host = rest.rpartition(":")[0].strip("[]")
    try:
        return HERE if protocol == "unixsock-stream" or ip_address(host).is_loopback else host
    except ValueError:
        return printable(host, limit=80)


def _names(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    return ", ".join(names[:_MOST_NAMES]) + more
