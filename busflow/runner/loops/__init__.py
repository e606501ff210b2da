"""Event loops: the system's, uvloop and the virtual one, and schedules that a virtual one explores. Knows no graph."""
