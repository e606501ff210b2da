"""busflow: a robot's node graph that you `pip install`."""
