"""A graph of nodes from start to end: supervision, restarts, signals and the report.

Knows no file of a recording and no Zenoh: `assembly` names what a run has of them by module alone.
"""
