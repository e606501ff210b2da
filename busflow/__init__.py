"""busflow: a robot's node graph that you `pip install`.

All public names of the core stand in `__init__.pyi`, each with its home. They are imported at first use, so that the
command line starts fast.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all else before the command line
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

__version__ = "0.1.0"


def imported_at_use(namespace: dict[str, Any]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a module whose stub lists its names (PEP 562); used by busflow itself."""
    homes: dict[str, str] = {}

    def find(name: str) -> Any:
        if not homes:
            stub: str = namespace["__spec__"].loader.get_data(f"{namespace['__file__']}i").decode()
            imports = [line.split() for line in stub.splitlines() if line.startswith("from busflow.")]
            homes.update({words[3]: words[1] for words in imports})
        if name == "__all__":
            value = sorted(homes)
        elif name in homes:
            from importlib import import_module

            value = getattr(import_module(homes[name]), name)
        else:
            raise AttributeError(f"module {namespace['__name__']!r} has no attribute {name!r}")
        namespace[name] = value
        return value

    namespace["__dir__"] = lambda: [*namespace, *find("__all__")]
    return find


__getattr__ = imported_at_use(globals())
