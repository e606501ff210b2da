"""What shows a graph of busflow in a browser or a viewer: commands that busflow finds by their entry points."""
