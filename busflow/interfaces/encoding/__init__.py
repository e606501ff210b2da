"""Encodings of messages: CDR, JSON and ROS 2's type descriptions. Opens no file and no connection."""
