"""The `busflow` command, and `python -m busflow`."""

import sys


def main() -> int:
    """Answer the command line; returns the exit code."""
    try:
        from busflow.cli import main as answer  # whoever presses Ctrl-C while it is imported is not shown a traceback

        return answer()
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
