"""Encodings of messages: CDR, JSON and ROS 2's type descriptions. Opens no connection, and no file but its own data.

`builtin_types` knows busflow's own types from a file that the build makes of `msgs/` (`hatch_build.py`), so that the
command line imports neither pydantic nor numpy for them.
"""
