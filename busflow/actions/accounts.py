"""Accounts of actions in the form of a report, taken from the accounts of their `send_goal` services."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from busflow.actions.names import SEND_GOAL, action_of, action_type_of

SERVER_COUNTS = ("rejected", "succeeded", "aborted", "canceled", "running", "queued")
"""The outcomes of the goals that a server has received; they add up to all of them."""
CLIENT_COUNTS = ("rejected", "succeeded", "aborted", "canceled", "left", "lost", "running")
"""The outcomes of the goals that a client has sent; they add up to all of them."""


def action_accounts(services: Sequence[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield `{name, type, servers, clients}` for each action among the services of a report's JSON."""
    for service in services:
        name = action_of(service["name"])
        if name is None or not service["name"].endswith(SEND_GOAL):
            continue
        yield {
            "name": name,
            "type": action_type_of(service["type"]) or service["type"],
            "servers": [
                {"node": line["node"], "received": line["received"], **_counts(line, SERVER_COUNTS)}
                for line in service["servers"]
            ],
            "clients": [
                {
                    "node": line["node"],
                    "sent": line["called"],
                    **_counts(line, CLIENT_COUNTS),
                    "feedback_dropped": line.get("feedback_dropped", 0),
                }
                for line in service["clients"]
            ],
        }


def _counts(line: Mapping[str, Any], words: Sequence[str]) -> dict[str, int]:
    return {word: line.get(word, 0) for word in words}
