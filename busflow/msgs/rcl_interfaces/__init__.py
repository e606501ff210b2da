"""`rcl_interfaces`: parameters, logs and log levels of running nodes, as ROS 2's tools ask for them."""

from busflow import imported_at_use

__getattr__ = imported_at_use(globals())  # a parameter needs no log
