"""A node that notes, in a worker process, the begin and the end of what takes part in the run beside nodes."""

import sys
from functools import wraps
from pathlib import Path

from busflow import Node
from busflow.recording.recorder.recorder import Recorder


def note(cls: type, name: str) -> None:
    """Write a line when this method of a class is called."""
    act = getattr(cls, name)

    @wraps(act)
    def noting(self: object) -> None:
        with Path("notes").open("a") as notes:
            notes.write(f"{cls.__name__} {name}\n")
        act(self)

    setattr(cls, name, noting)


if (part := getattr(sys.modules["__main__"], "_Part", None)) is not None:  # else this is the main process
    for each in (part, Recorder):
        note(each, "begin")
        note(each, "end")


class Noting(Node):
    """Has nothing to do."""
