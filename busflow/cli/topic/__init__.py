"""`busflow topic`: the topics of a running graph. The verbs are here by name; a file beside this has one or a few."""

from busflow.cli.options.lazy_group import LazyGroup

_HERE = "busflow.cli.topic"
_VERBS = {
    "list": (f"{_HERE}.listing:list_", "List the topics there are."),
    "info": (f"{_HERE}.info:info", "Tell a topic's type, and who publishes and receives it."),
    "echo": (f"{_HERE}.echo:echo", "Print the messages of a topic."),
    "hz": (f"{_HERE}.measuring:hz", "Measure how often topics are published."),
    "bw": (f"{_HERE}.measuring:bw", "Measure how many bytes a second topics carry."),
    "delay": (f"{_HERE}.measuring:delay", "Measure how old messages are when they are published, by their header."),
    "pub": (f"{_HERE}.pub:pub", "Publish messages on a topic."),
    "stats": (f"{_HERE}.stats:stats", "Show what became of every message so far."),
    "type": (f"{_HERE}.listing:type_", "Tell a topic's type."),
    "find": (f"{_HERE}.listing:find", "List the topics of a type."),
}
_EXAMPLES = """\b
Examples:
  busflow topic list -t
  busflow topic echo imu/data --field linear_acceleration.z
  busflow topic hz imu/data joint_states
  busflow topic pub --once joint_command std_msgs/msg/Float64 '{data: 0.5}'"""

topic = LazyGroup("topic", _VERBS, help="Look at the topics of a running graph, and publish to them.", epilog=_EXAMPLES)
