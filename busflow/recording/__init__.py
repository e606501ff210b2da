"""Recordings of a run, as MCAP files that ROS 2 reads: written, read, played and compared. Knows no Zenoh.

`mcap` frames and writes the files, `bag` reads them, `recorder` records a graph, `player` plays a bag into one,
`tools` work on finished bags, and `replay` runs nodes anew on one.
"""
