"""`geometry_msgs`: points, vectors, poses, velocities, forces and the transforms between frames; one file per kind.

Lengths are metres, angles radians, masses kilograms, forces newtons; frames are right-handed. A `…Stamped`
message adds the time and the frame; a `…WithCovariance` message adds how certain it is.
"""

from busflow import imported_at_use

__getattr__ = imported_at_use(globals())  # a Vector3 needs no polygon
