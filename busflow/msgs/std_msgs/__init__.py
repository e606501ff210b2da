"""`std_msgs`: the header of stamped messages, a colour, and wrappers around single values; one file per kind.

A wrapper says nothing about what its number means: prefer a message of your own with named fields.
"""

from busflow import imported_at_use

__getattr__ = imported_at_use(globals())  # a Header needs no array
