"""Zenoh sessions as `rmw_zenoh` opens them, and runs that let them in, each at a port of its own."""

import asyncio
import json
import random
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import zenoh

from busflow.launchfile.model.description import LaunchDescription
from busflow.launchfile.model.network import NetworkAddress
from busflow.launchfile.model.ros2 import Ros2Spec
from busflow.launchfile.yaml.value import Origin, StatedBy
from busflow.wire.zenoh.keys import Token, TokenKind

PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""
AGAIN_S = 0.2
"""The time after which a message is sent again."""

RMW_ZENOH = {
    "mode": "peer",
    "listen/endpoints": ["tcp/localhost:0"],
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": True,
    "scouting/gossip/target": {"router": ["router", "peer"], "peer": ["router"]},
    "scouting/gossip/autoconnect": {"router": [], "peer": ["router", "peer"]},
    "scouting/gossip/autoconnect_strategy": {"peer": {"to_router": "always", "to_peer": "greater-zid"}},
    "timestamping/enabled": {"router": True, "peer": True, "client": True},
    "transport/link/tx/keep_alive": 2,
    "transport/shared_memory/enabled": False,
}
"""What DEFAULT_RMW_ZENOH_SESSION_CONFIG.json5 of rmw_zenoh_cpp 0.10.5 says and Zenoh's defaults do not, and no test."""
ROUTER = {
    "mode": "router",
    "scouting/multicast/enabled": False,
    "scouting/delay": 1,
    "routing/router/peers_failover_brokering": False,
    "timestamping/enabled": {"router": True, "peer": True, "client": True},
}
"""The same of DEFAULT_RMW_ZENOH_ROUTER_CONFIG.json5, without its address."""


def free_port() -> int:
    """A port at which nobody listens, and which the system gives nobody for a connection of their own meanwhile."""
    while True:
        with socket.socket() as probe, suppress(OSError):
            probe.bind(("127.0.0.1", number := random.randrange(20_000, 32_000)))
            return number


@contextmanager
def opened(settings: dict[str, Any]) -> Iterator[Any]:
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config) as session:
        yield session


@contextmanager
def rmw_session(port: int, *, lease_ms: int = 60_000) -> Iterator[Any]:
    """A session of `rmw_zenoh` that has found its router, as its nodes wait for one."""
    own = {"connect/endpoints": [f"tcp/localhost:{port}"], "transport/link/tx/lease": lease_ms}
    with opened(RMW_ZENOH | own) as session:
        linked = threading.Event()
        listener = session.info.declare_transport_events_listener(lambda _event: linked.set(), history=True)
        assert linked.wait(PATIENCE_S)
        yield session
        listener.undeclare()


def ros2_at(port: int, **words: Any) -> LaunchDescription:
    """A launch file without nodes that lets nodes of ROS 2 in at this port."""
    router = NetworkAddress("tcp", "127.0.0.1", port, Origin(StatedBy.CALLER))
    return LaunchDescription("ros2", (), ros2=Ros2Spec(**{"domain": 7, "router": router} | words))


async def arrived(items: "asyncio.Queue[Any]") -> Any:
    """The next item, if it comes at all."""
    async with asyncio.timeout(PATIENCE_S):
        return await items.get()


async def until_arrived(send: Callable[[], object], queue: "asyncio.Queue[Any]", wanted: Any) -> list[Any]:
    """Send again and again until this arrives, and return what came before it.

    A node of ROS 2 does not say whether it is linked; and what was sent twice may arrive twice, the second time late.
    """
    before: list[Any] = []
    async with asyncio.timeout(PATIENCE_S):
        while wanted not in before:
            send()
            with suppress(TimeoutError):
                before.append(await asyncio.wait_for(queue.get(), AGAIN_S))
    return before[:-1]


async def until(condition: Callable[[], object]) -> None:
    """Wait until something holds that comes of other sessions, whose threads set no event."""
    async with asyncio.timeout(PATIENCE_S):
        while not condition():  # noqa: ASYNC110  # as above
            await asyncio.sleep(0.01)


async def has_come(session: Any, node: str) -> bool:
    """Wait until a session sees a node, by the subscription to tokens that each session of `rmw_zenoh` has."""
    loop, seen = asyncio.get_running_loop(), asyncio.Event()

    def on_token(sample: Any) -> None:
        token = Token.parse(str(sample.key_expr))
        if token.kind is TokenKind.NODE and token.node_name == node:
            loop.call_soon_threadsafe(seen.set)

    subscriber = session.liveliness().declare_subscriber("@ros2_lv/7/**", on_token, history=True)
    async with asyncio.timeout(PATIENCE_S):
        await seen.wait()
    subscriber.undeclare()
    return True


def to_loop(queue: asyncio.Queue[Any]) -> Callable[[Any], None]:
    """A function for Zenoh's threads that puts samples into a queue of the loop."""
    loop = asyncio.get_running_loop()
    return lambda sample: loop.call_soon_threadsafe(queue.put_nowait, sample)


async def in_thread(act: Callable[[], Any]) -> Any:
    """What a function returns that waits for the run, whose loop has to go on."""
    async with asyncio.timeout(PATIENCE_S):
        return await asyncio.to_thread(act)
