"""A new interpreter, for tests of what an import costs or brings."""

import subprocess
import sys


def printed_by(code: str, *arguments: str) -> str:
    """What the code prints in an interpreter that has imported nothing else; an error in it fails the test."""
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True)
    return done.stdout.strip()
