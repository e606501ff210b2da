"""The `busflow` command, and `python -m busflow`."""

import sys


def main() -> int:
    """Run the command line, and return its exit code."""
    try:
        from busflow.cli import main as answer  # no traceback for Ctrl-C during the import

        return answer()
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
