"""Keys of a launch file, the description that they make, and problems with their places. Reads no file."""
