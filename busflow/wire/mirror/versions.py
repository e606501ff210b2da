"""Versions: each process of a run on several machines shows its version of busflow, and learns those of the others.

It declares a token `@busflow/1/<process>/version/<version>`. Versions that do not know the token ignore it.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import zenoh

from busflow.wire.zenoh.keys import QUERY_PREFIX

_WORD = "version"
_MOST_CHARACTERS = 64


def exchange_versions(
    session: zenoh.Session, process: str, version: str, on_version: Callable[[str, str], None]
) -> tuple[object, object]:
    """Show a process's version, and call a function on the event loop with the name and version of each process.

    Returns:
        What has to be kept as long as the version is to be shown.
    """
    loop = asyncio.get_running_loop()

    def on_sample(sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.PUT:
            other, _, found = str(sample.key_expr).removeprefix(f"{QUERY_PREFIX}/").partition(f"/{_WORD}/")
            with suppress(RuntimeError):  # the loop has ended: nothing is left to notify
                loop.call_soon_threadsafe(on_version, other, found[:_MOST_CHARACTERS])

    callback: Any = zenoh.handlers.Callback(on_sample, indirect=False)
    liveliness = session.liveliness()
    token = liveliness.declare_token(f"{QUERY_PREFIX}/{process}/{_WORD}/{version}")
    subscriber: Any = liveliness.declare_subscriber(f"{QUERY_PREFIX}/*/{_WORD}/*", callback, history=True)
    return token, subscriber
