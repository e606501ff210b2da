"""A graph in a test: harness, faults, exploration of schedules, expectations, and the pytest plugin.

Hours on virtual time take milliseconds, and come out the same every time. Starts no process.
"""

from busflow import imported_at_use

__getattr__ = imported_at_use(globals())
