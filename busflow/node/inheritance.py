"""Which declarations a node class has: its own, those of its bases, and what overriding a method does to them."""

from __future__ import annotations

from types import FrameType, FunctionType
from typing import Any, cast

from busflow.node.declarations import Declaration, TimerDeclaration
from busflow.node.handlers import Handler


def declarations_of(node_class: type) -> dict[str, Declaration]:
    """The declarations of a class and its bases, by attribute, in the order they were first written."""
    found: dict[str, Declaration] = {}
    for owner in reversed(node_class.__mro__):
        for name, value in vars(owner).items():
            if isinstance(value, Declaration):
                found[name] = value
            elif name in found:
                del found[name]
    return found


def inherit(node_class: type, frame: FrameType) -> None:
    """Settle a new class's declarations: a method that overrides a handler without a decorator stays one."""
    for name in {name for base in node_class.__mro__ for name in vars(base)}:
        # The one who overrides may also be a mixin that knows nothing of nodes.
        value, above, *_ = [vars(base)[name] for base in node_class.__mro__ if name in vars(base)] + [None]
        renewed = _renewed(above, value) if isinstance(value, FunctionType) else None
        if renewed is not None:
            renewed.__set_name__(node_class, name)
            setattr(node_class, name, renewed)
    for value in vars(node_class).values():
        if isinstance(value, Handler):
            value.remember(frame)


def _renewed(above: object, function: FunctionType) -> Declaration | None:
    if isinstance(above, Handler):
        return Handler(function, above.roles, cast("Handler[..., Any]", above))
    if isinstance(above, TimerDeclaration):
        return above.with_function(function)
    return None
