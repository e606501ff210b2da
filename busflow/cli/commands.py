"""The place of `busflow.commands` in 0.1.0, for distributions of that time, e.g. its `busflow-ui`; gone in 0.2."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.commands import *  # noqa: F403  # every name there
    from busflow.commands import print_message

    tell = print_message


def __getattr__(name: str) -> Any:
    """Import a name when it is used (PEP 562)."""
    from busflow import commands
    from busflow.validation.versions import warn_of

    value = getattr(commands, "print_message" if name == "tell" else name)
    warn_of("busflow.cli.commands", instead="write busflow.commands", gone_in="0.2")
    return value
