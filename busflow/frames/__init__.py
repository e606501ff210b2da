"""Frames: the tree of coordinate frames, what nodes say about it, and the messages that it moves from one to another.

Draws nothing and reads no recording: `busflow tf` does. The wire form is ROS 2's: `tf2_msgs/msg/TFMessage` on `/tf` and
`/tf_static`.

- `rigid`, `edge`, `tree`: pure. A motion is a tuple of seven numbers, an edge a list of stamped motions, a tree a
  dictionary of edges by child; a path between two frames is kept until an edge comes or goes.
- `shared`: one tree for each process and pair of topics, in `Bus.shared`. It takes in a message once, as it is
  published, before any queue; the subscriptions of the nodes bring the messages of other processes, and show up in
  graphs and ledgers. A lookup that must wait is woken by the one edge that lags.
- `declarations`: `transforms()`, and what a node has in its place.
- `moving`: the stamped messages that `apply` takes to another frame.
- `static_frames`: the node behind `frames:` of a launch file.
"""
