"""From a launch file to a checked description of a graph. Runs nothing."""
