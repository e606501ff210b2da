"""A run's endpoints shown to other processes, and messages that cross. Prints nothing."""
