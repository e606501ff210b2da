"""A terminal's side of a run: what it sees, hears and sends. Runs no node."""
