"""Recordings of a run: MCAP files that ROS 2's tools read as they read their own."""
