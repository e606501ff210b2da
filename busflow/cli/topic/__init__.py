"""`busflow topic`: the verbs for the topics of a running graph by name; they are in modules of this package."""

from busflow.cli.options.lazy_group import LazyGroup

_HERE = "busflow.cli.topic"
_VERBS = {
    "list": (f"{_HERE}.listing:list_", "List the topics."),
    "info": (f"{_HERE}.info:info", "Show a topic's type, and its publishers and subscriptions."),
    "echo": (f"{_HERE}.echo:echo", "Print the messages of a topic."),
    "hz": (f"{_HERE}.measuring:hz", "Measure how often topics are published."),
    "bw": (f"{_HERE}.measuring:bw", "Measure how many bytes a second topics carry."),
    "delay": (f"{_HERE}.measuring:delay", "Measure how old messages are when they are published, by their header."),
    "pub": (f"{_HERE}.pub:pub", "Publish messages on a topic."),
    "stats": (f"{_HERE}.stats:stats", "Show the ledger of every topic so far."),
    "type": (f"{_HERE}.listing:type_", "Show a topic's type."),
    "find": (f"{_HERE}.listing:find", "List the topics of a type."),
}
_EXAMPLES = """\b
Examples:
  busflow topic list -t
  busflow topic echo imu/data --field linear_acceleration.z
  busflow topic hz imu/data joint_states
  busflow topic pub --once joint_command std_msgs/msg/Float64 '{data: 0.5}'"""

topic: LazyGroup = LazyGroup(
    "topic", _VERBS, help="Look at the topics of a running graph, and publish to them.", epilog=_EXAMPLES
)
