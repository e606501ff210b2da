"""Queries that a run answers: its graph, logs, parameters and kept messages. Sends only replies."""
