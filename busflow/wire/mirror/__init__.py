"""A run's endpoints shown to other processes, and messages between processes. Prints nothing."""
