"""A bag played into a graph, or into a run of another process. Compares nothing.

`playback_clock` is the time of a recording that is played: paused, faster, slower, set to another moment.
`ordered_messages` has the messages to play, in the file's order, within a span of time; `playing` hands them over by
that clock. Two use it: `player`, a node that publishes messages (a type without a class passes as bytes), and
`bag play --run`, which hands the bytes to a client of the run.
"""

from busflow import imported_at_use

__getattr__ = imported_at_use(globals())
