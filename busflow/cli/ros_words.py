"""Words that users of ROS 2 type and busflow does not have, each with what to write instead. Pure data."""

from __future__ import annotations

_ENDS = "kill PID ends a run as Ctrl-C does, and busflow ps shows its PID; busflow node stop NODE stops one node"
_ROS_ONLY = "it works on ROS 2's own installation; programs: of a launch file start what it has"
_VERBS = {
    "control": _ROS_ONLY,
    "security": "write busflow certs, which makes the certificates that link machines",
    "wtf": "write busflow doctor",
    "kill": _ENDS,
    "shutdown": _ENDS,
    "stop": _ENDS,
    "component": "nodes share a process unless the launch file says `process:`; busflow node list shows them",
    "daemon": "there is none to start or stop; busflow ps lists what runs",
    "launch": "write busflow run FILE",
    "lifecycle": "busflow node start, stop and restart change a node's state; busflow node list -v shows it",
    "multicast": "busflow doctor checks the running graphs and what they need on this machine",
    "pkg": "busflow plugins lists the plugins, busflow interface packages the packages of types; busflow new makes one",
}
_REINDEX = (
    "a bag is read without its metadata.yaml; write busflow bag convert BAG NEW --to ros2bag "
    "for one that has it, and busflow bag recover for a damaged file"
)
_VERBS_BELOW = {
    ("bag", "burst"): "write busflow bag play -p, and step with the key s",
    ("bag", "list"): "there is one format, MCAP; write busflow bag info FILE for what is in a recording",
    ("bag", "reindex"): _REINDEX,
    ("param", "delete"): "a parameter is part of its node's class; write busflow param set to give it another value",
}
_PARAMETER = (
    "write --set nodes.NODE.parameters.NAME=VALUE, or NAME:=VALUE for an argument of the launch file or with --plugin"
)
_NO_DAEMON = "leave it out: no daemon stands between, each run answers for itself"
_READS_ALL = "it receives what is published, whatever its QoS; leave it out"
_ANY_STORAGE = "leave it out: a bag says itself how it is stored"
_OPTIONS = {
    ("", "--no-daemon"): _NO_DAEMON,
    ("", "--spin-time"): _NO_DAEMON,
    ("doctor", "--report"): "leave it out: all is shown; --json is for programs",
    ("doctor", "-r"): "leave it out: all is shown; --json is for programs",
    ("run", "--ros-args"): f"leave it out; {_PARAMETER}",
    ("run", "-p"): _PARAMETER,
    ("run", "--param"): _PARAMETER,
    ("run", "--params-file"): "write --set nodes.NODE.parameters_from=FILE",
    ("run", "--log-level"): "write --verbose for debug lines; busflow log --set NODE LEVEL is for one node",
    ("run", "--show-args"): "write busflow run FILE --help",
    ("run", "-s"): "write busflow run FILE --help, which shows the arguments",
    ("run", "--print"): "write busflow config FILE",
    ("call", "-r"): "call it again and again from the shell: while busflow service call …; do sleep 1; done",
    ("call", "--rate"): "call it again and again from the shell: while busflow service call …; do sleep 1; done",
    ("convert", "-i"): "write busflow bag convert IN OUT",
    ("convert", "--input"): "write busflow bag convert IN OUT",
    ("convert", "-o"): "write busflow bag convert IN OUT --to FORMAT, without a file of options",
    ("convert", "--output-options"): "write busflow bag convert IN OUT --to FORMAT, without a file of options",
    ("play", "-i"): "write busflow bag play FILE",
    ("play", "--input"): "write busflow bag play FILE",
    **{(verb, option): _ANY_STORAGE for verb in ("info", "play", "convert") for option in ("-s", "--storage")},
    ("play", "--start-offset"): "write --start 3s",
    ("play", "--playback-duration"): "write --duration 5s",
    **{(verb, "--qos-"): _READS_ALL for verb in ("echo", "hz", "bw", "delay")},
    ("record", "-s"): "it writes MCAP; leave it out",
    ("record", "--storage"): "it writes MCAP; leave it out",
    ("record", "--qos-"): "it records what is published, whatever its QoS; leave it out",
    ("play", "--qos-"): "it publishes with the QoS that was recorded; leave it out",
}
"""What to write instead of an option, by command and option; one that ends with `-` stands for all that begin so, and
an empty command for any.
"""


def instead_of_verb(name: str, group: str = "") -> str | None:
    """Return what to write instead of a command that busflow does not have, of its own or below another one.

    >>> instead_of_verb("launch"), instead_of_verb("burst", "bag")
    ('write busflow run FILE', 'write busflow bag play -p, and step with the key s')
    """
    return _VERBS_BELOW.get((group, name)) if group else _VERBS.get(name)


def instead_of_option(command: str | None, option: str) -> str | None:
    """Return what to write instead of an option of ROS 2.

    >>> instead_of_option("play", "--start-offset")
    'write --start 3s'
    >>> instead_of_option("echo", "--qos-depth")
    'it receives what is published, whatever its QoS; leave it out'
    """
    family = option[: option.find("-", 2) + 1]
    found = (_OPTIONS.get(key) for key in ((command or "", option), (command or "", family), ("", option)))
    return next(filter(None, found), None)
