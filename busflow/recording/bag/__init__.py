"""Bags to read: MCAP files and ROS 2's bags, with what is known of their completeness. Writes nothing.

- `mcap_file` reads a file's messages from the front, also if the file has no end; with a summary it skips chunks.
- `rosbag2` finds the files of a directory; a database is a `bag_file` as an MCAP file is.
- `Bag` groups its files into `series`, of which each has numbers of its own: one, or one of each process and life,
  which are merged by time.
- `channel` turns bytes into values by the definition in the bag, and by a class only on request, so that `bag info` and
  `bag echo` import neither pydantic nor numpy.
"""

from busflow import imported_at_use

__getattr__ = imported_at_use(globals())
