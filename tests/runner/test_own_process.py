"""What an object does in a forked process, tried in a process of its own: pytest's may have threads."""

import subprocess
import sys

import pytest

PROGRAM = """
import os, weakref
from busflow.runner.own_process import call_in_children


class Lamp:
    def __init__(self, name):
        self.name, self.lit = name, True
        call_in_children(self.put_out)

    def put_out(self):
        self.lit = False
        print("put out:", self.name, flush=True)


kept, let_go = Lamp("kept"), Lamp("let go")
reference = weakref.ref(let_go)
del let_go
if os.fork() == 0:
    os._exit(kept.lit)
_, status = os.wait()
print(os.waitstatus_to_exitcode(status), kept.lit, reference())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows forks nothing")
def test_methods_of_live_objects_run_only_in_forks():
    ended = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=60)
    assert (ended.stdout.splitlines(), ended.stderr) == (["put out: kept", "0 True None"], "")
