"""Peers: what a user would pick instead of busflow, each wired as its own documentation would have it.

A *way* of handing on messages within a process is an asynchronous context manager. It is told where messages come from
and who hears them, and gives back a function for each source that publishes a message there. Where such a function
returns an awaitable, it is to be awaited.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager
from typing import Any

Handler = Callable[[Any], Any]
Publish = Callable[[Any], Any]
Way = Callable[[Sequence[str], Sequence[tuple[str, Handler]]], AbstractAsyncContextManager[list[Publish]]]
"""Takes the topics of the publishers and the topic of each handler."""
