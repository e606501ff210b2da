"""Keys of a launch file, the `LaunchDescription` made from them, and problems with their places. Reads no file."""
