"""Viewers of a busflow graph, in a browser or elsewhere: commands that busflow finds by their entry points."""
