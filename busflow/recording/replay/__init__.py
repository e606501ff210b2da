"""Nodes run anew on a recording, and compared with it. Needs virtual time."""
