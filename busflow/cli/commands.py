"""What commands of other distributions may use of busflow, beside its public names, `errors`, `text` and `clock`.

docs/commands.md lists these names; decision 13 says what is promised of them. Each is imported when it is first used,
so that a command's `--help` costs nothing.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.bus.names import check_full_topic_name, full_topic_name_fault
    from busflow.bus.patterns import Selection
    from busflow.cli.options.run import (
        complete_nodes,
        complete_runs,
        complete_services,
        complete_topics,
        complete_types,
        joined,
        joins,
    )
    from busflow.cli.terminal.output import print_answer, print_line, tell
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.interfaces.encoding.json_form import decode as decode_json
    from busflow.interfaces.encoding.json_form import finite
    from busflow.wire.client.client import Peer, ServiceKind
    from busflow.wire.client.graph_view import EndView, GraphView, TopicView
    from busflow.wire.client.known_type import known_type
    from busflow.wire.client.listener import Listener
    from busflow.wire.client.speaker import Speaker

_HOMES = {
    "EndView": "wire.client.graph_view",
    "ForeignType": "interfaces.encoding.foreign",
    "GraphView": "wire.client.graph_view",
    "Listener": "wire.client.listener",
    "Peer": "wire.client.client",
    "Selection": "bus.patterns",
    "ServiceKind": "wire.client.client",
    "Speaker": "wire.client.speaker",
    "TopicView": "wire.client.graph_view",
    "check_full_topic_name": "bus.names",
    "complete_nodes": "cli.options.run",
    "complete_runs": "cli.options.run",
    "complete_services": "cli.options.run",
    "complete_topics": "cli.options.run",
    "complete_types": "cli.options.run",
    "decode_json": "interfaces.encoding.json_form:decode",
    "finite": "interfaces.encoding.json_form",
    "full_topic_name_fault": "bus.names",
    "joined": "cli.options.run",
    "joins": "cli.options.run",
    "known_type": "wire.client.known_type",
    "print_answer": "cli.terminal.output",
    "print_line": "cli.terminal.output",
    "tell": "cli.terminal.output",
}

__all__ = [
    "EndView",
    "ForeignType",
    "GraphView",
    "Listener",
    "Peer",
    "Selection",
    "ServiceKind",
    "Speaker",
    "TopicView",
    "check_full_topic_name",
    "complete_nodes",
    "complete_runs",
    "complete_services",
    "complete_topics",
    "complete_types",
    "decode_json",
    "finite",
    "full_topic_name_fault",
    "joined",
    "joins",
    "known_type",
    "print_answer",
    "print_line",
    "tell",
]


def __getattr__(name: str) -> Any:
    """Import a name when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'busflow.cli.commands' has no attribute {name!r}")
    from importlib import import_module

    module, _, attribute = _HOMES[name].partition(":")
    value = globals()[name] = getattr(import_module(f"busflow.{module}"), attribute or name)
    return value
