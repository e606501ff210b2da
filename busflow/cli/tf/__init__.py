"""`busflow tf`: the verbs for the frames of a running graph or a recording; they are in modules of this package."""

from busflow.cli.options.lazy_group import LazyGroup

_HERE = "busflow.cli.tf"
_VERBS = {
    "tree": (f"{_HERE}.tree:tree", "Draw the tree of frames."),
    "echo": (f"{_HERE}.echo:echo", "Print the transform between two frames."),
    "monitor": (f"{_HERE}.monitor:monitor", "Show how often each transform comes, how late, and from which node."),
}
_EXAMPLES = """\b
Examples:
  busflow tf tree
  busflow tf echo map base_link
  busflow tf monitor --for 5s
  busflow tf tree --bag run.mcap --format dot | dot -Tsvg > frames.svg"""

tf: LazyGroup = LazyGroup(
    "tf", _VERBS, help="Look at the frames of a running graph, or of a recording.", epilog=_EXAMPLES
)
