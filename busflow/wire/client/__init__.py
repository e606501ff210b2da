"""A client's side of a run: what it sees, receives and publishes. Runs no node."""
