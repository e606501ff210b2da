"""A node whose file prints when it is imported."""

from busflow import Node

print("imported")


class Printing(Node):
    """Does nothing."""
