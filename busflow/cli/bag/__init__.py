"""`busflow bag`: the verbs for recordings by name; each is in a module of this package."""

from busflow.cli.options.lazy_group import LazyGroup

_HERE = "busflow.cli.bag"
_VERBS = {
    "record": (f"{_HERE}.record:record", "Record topics of a running graph."),
    "snapshot": (f"{_HERE}.snapshot:snapshot", "Write the last moments of a running graph."),
    "info": (f"{_HERE}.info:info", "Show what a recording holds, and whether it is complete."),
    "echo": (f"{_HERE}.echo:echo", "Print the messages of a topic."),
    "play": (f"{_HERE}.play:play", "Publish a recording, in a run of its own or into another."),
    "verify": (f"{_HERE}.verify:verify", "Read all of it, and report what is wrong."),
    "diff": (f"{_HERE}.diff:diff", "Compare two recordings message by message."),
    "convert": (f"{_HERE}.convert:convert", "Write it for ROS 2, as tables, or as JSON."),
    "recover": (f"{_HERE}.recover:recover", "Write what can be read of a damaged file to a new one."),
}
_EXAMPLES = """\b
Examples:
  busflow bag record -o run.mcap --all
  busflow bag info run.mcap
  busflow bag echo run.mcap imu/data --field linear_acceleration.z
  busflow bag play run.mcap --rate 2"""

bag: LazyGroup = LazyGroup("bag", _VERBS, help="Make recordings, look at them, and work with them.", epilog=_EXAMPLES)
