"""`rcl_interfaces` offers what its files define; `test_msgs.py` compares every field with ROS 2's.

Tests of `logging.py`, `parameters.py` and `services.py`.
"""

from busflow.interfaces.message import Message, ServiceType
from busflow.msgs import rcl_interfaces
from busflow.msgs.rcl_interfaces import logging, parameters, services


def test_the_package_offers_each_type_of_its_files():
    defined = {
        name
        for module in (logging, parameters, services)
        for name, each in vars(module).items()
        if isinstance(each, type) and issubclass(each, Message | ServiceType) and each.__module__ == module.__name__
    }
    assert defined == set(rcl_interfaces.__all__)
