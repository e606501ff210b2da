"""`busflow interface`: the verbs for types: of busflow, of definition files and of a running graph."""

from busflow.cli.options.lazy_group import LazyGroup

_HERE = "busflow.cli.interface"
_VERBS = {
    "list": (f"{_HERE}.show:list_", "List the message, service and action types."),
    "show": (f"{_HERE}.show:show", "Show the fields of a type."),
    "proto": (f"{_HERE}.show:proto", "Show the values of a new message of a type."),
    "package": (f"{_HERE}.show:package", "List the types of one package."),
    "packages": (f"{_HERE}.show:packages", "List the packages that have types."),
    "generate": (f"{_HERE}.source:generate", "Write the classes of packages of definition files."),
    "export": (f"{_HERE}.source:export", "Write definition files for classes."),
}
EXAMPLES = """\b
Examples:
  busflow interface list -m
  busflow interface show sensor_msgs/msg/Imu
  busflow interface proto sensor_msgs/msg/Imu --no-quotes > imu.yaml
  busflow interface package std_srvs"""

interface: LazyGroup = LazyGroup(
    "interface", _VERBS, help="Look at message, service and action types, and write them.", epilog=EXAMPLES
)
