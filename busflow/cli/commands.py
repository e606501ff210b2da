"""The interface for commands of other distributions, beside busflow's public names, `errors`, `text` and `clock`.

docs/commands.md lists these names; decision 13 says how stable they are. Each is imported when it is first used, so
that a command's `--help` costs nothing.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.bus.names import check_full_topic_name, full_topic_name_fault, is_hidden
    from busflow.bus.patterns import Selection
    from busflow.cli.doctor import problems_in
    from busflow.cli.log import kept_lines, set_log_level
    from busflow.cli.node import order_nodes
    from busflow.cli.options.interfaces import takes_interfaces
    from busflow.cli.options.run import (
        complete_nodes,
        complete_runs,
        complete_services,
        complete_topics,
        complete_types,
        joined,
        joins,
    )
    from busflow.cli.param.changes import saved_parameters, stated_parameters
    from busflow.cli.plugins import plugin_places
    from busflow.cli.terminal.output import print_answer, print_line
    from busflow.cli.terminal.output import print_message as tell
    from busflow.description.packages import package_file
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.interfaces.encoding.json_form import decode as decode_json
    from busflow.interfaces.encoding.json_form import finite
    from busflow.launchfile.model.description import Compression
    from busflow.launchfile.yaml.file_edit import LaunchFileEdit, launch_key, saved_key
    from busflow.processes.remote_recorder import RemoteRecorder
    from busflow.recording.bag import Bag
    from busflow.recording.bag.channel import Channel, Entry
    from busflow.wire.client.actions import ActionPeer, PeerGoal, action_named, actions_of
    from busflow.wire.client.client import Peer, ServiceKind
    from busflow.wire.client.graph_view import EndView, GraphView, NodeView, TopicView
    from busflow.wire.client.known_type import known_type
    from busflow.wire.client.listener import Listener
    from busflow.wire.client.offer import Offer, misfits
    from busflow.wire.client.speaker import Speaker

_HOMES = {
    "bus.names": ("check_full_topic_name", "full_topic_name_fault", "is_hidden"),
    "bus.patterns": ("Selection",),
    "cli.doctor": ("problems_in",),
    "cli.log": ("kept_lines", "set_log_level"),
    "cli.node": ("order_nodes",),
    "cli.options.interfaces": ("takes_interfaces",),
    "cli.options.run": (
        *("complete_nodes", "complete_runs", "complete_services", "complete_topics", "complete_types"),
        *("joined", "joins"),
    ),
    "cli.param.changes": ("saved_parameters", "stated_parameters"),
    "cli.plugins": ("plugin_places",),
    "cli.terminal.output": ("print_answer", "print_line", "tell"),
    "description.packages": ("package_file",),
    "interfaces.encoding.foreign": ("ForeignType",),
    "interfaces.encoding.json_form": ("decode_json", "finite"),
    "launchfile.model.description": ("Compression",),
    "launchfile.yaml.file_edit": ("LaunchFileEdit", "launch_key", "saved_key"),
    "processes.remote_recorder": ("RemoteRecorder",),
    "recording.bag": ("Bag",),
    "recording.bag.channel": ("Channel", "Entry"),
    "wire.client.actions": ("ActionPeer", "PeerGoal", "action_named", "actions_of"),
    "wire.client.client": ("Peer", "ServiceKind"),
    "wire.client.graph_view": ("EndView", "GraphView", "NodeView", "TopicView"),
    "wire.client.known_type": ("known_type",),
    "wire.client.listener": ("Listener",),
    "wire.client.offer": ("Offer", "misfits"),
    "wire.client.speaker": ("Speaker",),
}
"""The modules, each with its names that this module offers."""
_ORIGINALS = {"decode_json": "decode", "tell": "print_message"}
"""The names that differ from the name in their module."""

__all__ = [
    "ActionPeer",
    "Bag",
    "Channel",
    "Compression",
    "EndView",
    "Entry",
    "ForeignType",
    "GraphView",
    "LaunchFileEdit",
    "Listener",
    "NodeView",
    "Offer",
    "Peer",
    "PeerGoal",
    "RemoteRecorder",
    "Selection",
    "ServiceKind",
    "Speaker",
    "TopicView",
    "action_named",
    "actions_of",
    "check_full_topic_name",
    "complete_nodes",
    "complete_runs",
    "complete_services",
    "complete_topics",
    "complete_types",
    "decode_json",
    "finite",
    "full_topic_name_fault",
    "is_hidden",
    "joined",
    "joins",
    "kept_lines",
    "known_type",
    "launch_key",
    "misfits",
    "order_nodes",
    "package_file",
    "plugin_places",
    "print_answer",
    "print_line",
    "problems_in",
    "saved_key",
    "saved_parameters",
    "set_log_level",
    "stated_parameters",
    "takes_interfaces",
    "tell",
]


def __getattr__(name: str) -> Any:
    """Import a name when it is first used (PEP 562)."""
    home = next((module for module, names in _HOMES.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module 'busflow.cli.commands' has no attribute {name!r}")
    from importlib import import_module

    value = globals()[name] = getattr(import_module(f"busflow.{home}"), _ORIGINALS.get(name, name))
    return value
