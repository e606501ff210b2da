"""The interface for other distributions, e.g. their commands, beside the public names, `errors`, `text` and `clock`.

docs/commands.md lists its names; decision 13 says how stable they are. They stand in `commands.pyi`. Each is imported
when it is first used, so that a command's `--help` costs nothing.
"""

from busflow import imported_at_use

__getattr__ = imported_at_use(globals())
