"""A new interpreter, for tests of what an import costs or brings."""

import subprocess
import sys


def printed_by(code: str, *arguments: str) -> str:
    """What the code prints in an interpreter that has imported nothing else; an error in it fails the test."""
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def files_imported_for(package: str, *names: str) -> list[str]:
    """Name the files of messages that each type of a package brings, one type after the other: `std_msgs.header`."""
    code = f"""
import sys
from busflow.msgs import {package}
seen = set(sys.modules)
for name in {names}:
    getattr({package}, name)
    new = sorted(each.removeprefix("busflow.msgs.") for each in set(sys.modules) - seen if each.count(".") == 3)
    print(*[each for each in new if "_msgs." in each])
    seen |= set(sys.modules)
"""
    return printed_by(code).splitlines()
