"""`RmwNode`: a node of ROS 2 on a raw Zenoh session, that does byte by byte what the sources of `rmw_zenoh` 0.10.5 do.

Nothing here is of busflow: names, tokens, gids and attachments are written out, so that a test compares two sources.
"""

import struct
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from itertools import count
from typing import Any

import xxhash
import zenoh
import zenoh.ext

RELIABLE, LATCHED = "::,10:,:,:,,", ":1:,5:,:,:,,"
STATUS = ":1:,1:,:,:,,"
"""`rcl_action_qos_profile_status_default`."""


class RmwNode:
    """One node; its endpoints are made by its methods and end with the session."""

    def __init__(self, session: Any, name: str, *, domain: int = 7, humble: bool = False) -> None:
        """Show the node; what `rmw_zenoh` 0.1.9 of Humble does is the same but for the word in place of a hash."""
        self.session, self.name, self.domain, self.humble = session, name, domain, humble
        self.zid = str(session.info.zid())
        self.ids = count(1)
        self.graph: dict[str, bool] = {}
        self.changed = threading.Condition()
        self.kept = [self.token(f"0/0/NN/%/%/{name}")]
        graph = session.liveliness().declare_subscriber(f"@ros2_lv/{domain}/**", self.on_token, history=True)
        self.kept.append(graph)

    def token(self, rest: str) -> Any:
        return self.session.liveliness().declare_token(f"@ros2_lv/{self.domain}/{self.zid}/{rest}")

    def leave(self) -> None:
        """End the node for others, as the first thing that the end of its process does."""
        for each in self.kept:
            if isinstance(each, zenoh.LivelinessToken):
                each.undeclare()

    def on_token(self, sample: Any) -> None:
        with self.changed:
            self.graph[str(sample.key_expr)] = sample.kind == zenoh.SampleKind.PUT
            self.changed.notify_all()

    def sees(self, *parts: str, there: bool = True, patience_s: float = 60.0) -> str:
        """Wait until a token with all these parts is there, or gone; return it."""

        def found() -> list[str]:
            return [key for key, alive in self.graph.items() if alive is there and all(part in key for part in parts)]

        with self.changed:
            assert self.changed.wait_for(found, patience_s), (parts, [k for k, alive in self.graph.items() if alive])
            return found()[0]

    @contextmanager
    def endpoint(self, kind: str, name: str, type_: str, type_hash: str, qos: str) -> Generator[tuple[str, bytes]]:
        """The key of an endpoint's topic or service, and its gid; declared within, it is shown after that.

        In this order `rmw_zenoh` does it (`rmw_service_data.cpp`): who sees a server may call it at once.
        """
        type_hash = "TypeHashNotSupported" if self.humble else type_hash
        package, group, short = type_.split("/")
        dds = f"{package}::{group}::dds_::{short}_"
        rest = f"0/{next(self.ids)}/{kind}/%/%/{self.name}/{name.replace('/', '%')}/{dds}/{type_hash}/{qos}"
        gid = xxhash.xxh3_128_digest(f"@ros2_lv/{self.domain}/{self.zid}/{rest}".encode())[::-1]
        yield f"{self.domain}/{name.strip('/')}/{dds}/{type_hash}", gid
        self.kept.append(self.token(rest))

    def end(self, kind: str, name: str, type_: str, type_hash: str, qos: str) -> tuple[str, bytes]:
        """Show an endpoint for which nothing is declared; return the key of its topic or service, and its gid."""
        with self.endpoint(kind, name, type_, type_hash, qos) as shown:
            return shown

    def publisher(self, topic: str, support: Any, qos: str = RELIABLE) -> Callable[..., None]:
        """A publisher; what is returned publishes bytes."""
        with self.endpoint("MP", topic, support.name, support.type_hash, qos) as (key, gid):
            if (depth := latched_depth(qos)) is not None:
                way: Any = zenoh.ext.declare_advanced_publisher(
                    self.session,
                    key,
                    cache=zenoh.ext.CacheConfig(max_samples=depth),
                    publisher_detection=True,
                    sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=0.5),
                )
            else:
                way = self.session.declare_publisher(key)
            self.kept.append(way)
        numbers = count(1)

        def publish(payload: bytes) -> None:
            way.put(payload, attachment=struct.pack("<qqB", next(numbers), time.time_ns(), 16) + gid)

        return publish

    def subscription(self, topic: str, support: Any, on_sample: Callable[[Any], None], qos: str = RELIABLE) -> None:
        with self.endpoint("MS", topic, support.name, support.type_hash, qos) as (key, _):
            if (depth := latched_depth(qos)) is not None:
                history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=depth)
                recovery = zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True)
                way: Any = zenoh.ext.declare_advanced_subscriber(
                    self.session, key, on_sample, history=history, recovery=recovery
                )
            else:
                way = self.session.declare_subscriber(key, on_sample)
            self.kept.append(way)

    def server(self, name: str, support: Any, answer: Callable[[bytes], bytes]) -> None:
        """A server that answers each request at once."""
        self.late_server(name, support, lambda request, reply: reply(answer(request)))

    def late_server(
        self, name: str, support: Any, on_request: Callable[[bytes, Callable[[bytes], None]], None]
    ) -> None:
        """A server that gets each request with a function that answers it, now or later."""
        with self.endpoint("SS", name, support.name, support.type_hash, RELIABLE) as (key, _):

            def on_query(query: Any) -> None:
                number, _, length = struct.unpack_from("<qqB", query.attachment.to_bytes())
                assert length == 16
                attachment = struct.pack("<qqB", number, time.time_ns(), 16) + query.attachment.to_bytes()[17:33]

                def reply(payload: bytes) -> None:
                    query.reply(key, payload, attachment=attachment)
                    query.drop()

                on_request(query.payload.to_bytes(), reply)

            self.kept.append(self.session.declare_queryable(key, on_query, complete=True))

    def client(self, name: str, support: Any) -> Callable[[bytes], tuple[bytes, int, bytes]]:
        """A client; what is returned calls the service, and returns the answer with the number and gid that came with
        it, by which `rmw_zenoh` finds the call.
        """
        key, gid = self.end("SC", name, support.name, support.type_hash, RELIABLE)
        numbers = count(41)

        def call(payload: bytes) -> tuple[bytes, int, bytes]:
            sent = next(numbers)
            replies = self.session.get(
                key,
                payload=payload,
                attachment=struct.pack("<qqB", sent, time.time_ns(), 16) + gid,
                target=zenoh.QueryTarget.ALL_COMPLETE,
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=60.0,
            )
            (reply,) = list(replies)
            assert reply.ok is not None, reply.err.payload.to_string()
            number, _, length = struct.unpack_from("<qqB", reply.ok.attachment.to_bytes())
            assert (number, length, reply.ok.attachment.to_bytes()[17:]) == (sent, 16, gid)
            return reply.ok.payload.to_bytes(), number, gid

        return call

    def call(self, name: str, support: Any, payload: bytes) -> tuple[bytes, int, bytes]:
        """Call a service once."""
        return self.client(name, support)(payload)


def latched_depth(qos: str) -> int | None:
    """The depth of a transient_local QoS; None of a volatile one."""
    return int(qos.split(",")[1].partition(":")[0]) if qos.startswith(":1:") else None
