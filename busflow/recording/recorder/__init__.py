"""A recording of a graph that runs. Reads no bag."""
