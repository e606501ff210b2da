"""Commands of busflow one after the other in one interpreter, as JSON: `python -m tests.other_platforms ps`."""

import io
import json
import sys
from contextlib import redirect_stderr, redirect_stdout


def ran(commands: list[str]) -> dict[str, tuple[int, str, str]]:
    """Each command's exit code, output and errors."""
    from busflow.cli import main  # as the platform has it

    done: dict[str, tuple[int, str, str]] = {}
    for command in commands:
        with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as err:
            code = main(command.split())
        done[command] = int(code or 0), out.getvalue(), err.getvalue()
    return done


if __name__ == "__main__":
    json.dump(ran(sys.argv[1:]), sys.stdout)
