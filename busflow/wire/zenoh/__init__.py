"""Zenoh sessions, their keys, and where the runs of this user are found. Knows no graph."""
