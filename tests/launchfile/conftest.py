"""Fixtures for all tests of launch files."""

from tests.launch_folder import folder, machines

__all__ = ["folder", "machines"]
