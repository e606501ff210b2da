"""What leaves the process: CDR as ROS 2 writes it, type descriptions, and the Zenoh session that mirrors a bus."""
