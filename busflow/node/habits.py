"""Habit: a name that nodes have in rclpy and not here, which says what to write instead.

A node that is asked for it raises AttributeError, in the words of docs/coming-from-rclpy.md. Attributes of a class cost
no other one anything, as a `__getattr__` would on Python 3.11; and a node may have methods of these names.
"""

from __future__ import annotations

from typing import Never

_HERE = {
    "add_on_set_parameters_callback": "a validator of the Parameters class",
    "add_post_set_parameters_callback": "@on_parameters above def retune(self, old)",
    "create_guard_condition": "an asyncio.Event",
    "create_rate": "a timer, or await self.clock.sleep(0.1) in async def run(self)",
    "declare_parameter": "a field of the Parameters class, with Field(default=1.0, ge=0, description=…)",
    "declare_parameters": "a field of the Parameters class, with Field(default=1.0, ge=0, description=…)",
    "destroy_node": "async def stop(self)",
    "get_clock": "self.clock.now()",
    "get_logger": 'self.log.info("text", x=x)',
    "get_name": "self.name",
    "get_parameter": "self.parameters.a",
    "get_parameters": "self.parameters.a",
    "set_parameters": 'graph.set_parameters("node", {"noise.imu": 0.5})',
}


class Habit:
    """What is where such a name would be."""

    def __init__(self, name: str, here: str) -> None:
        self._name, self._here = name, here

    def __get__(self, instance: object, owner: type) -> Never:
        raise AttributeError(f"{owner.__name__} has no {self._name}, which is rclpy's; here it is {self._here}")


class Habits:
    """A class with rclpy's names, of which a node is one."""


for _name, _here in _HERE.items():  # one by one, so that type checkers do not take them for attributes
    setattr(Habits, _name, Habit(_name, _here))
