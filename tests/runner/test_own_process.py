"""What an object does in a forked process, tried in a process of its own: pytest's may have threads."""

import signal
import subprocess
import sys

import pytest

from busflow.runner.own_process import children, end_children

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


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux lists the children of a process")
def test_children_end_but_one_in_a_session_of_its_own():
    before, lines = children(), list[str]()
    plain = subprocess.Popen(["sleep", "610"])
    deaf = subprocess.Popen(["sh", "-c", "trap '' TERM; echo; sleep 611 & wait; sleep 612"], stdout=subprocess.PIPE)
    own = subprocess.Popen(["sleep", "613"], start_new_session=True)
    with own, deaf, plain:
        assert deaf.stdout is not None
        assert deaf.stdout.readline() == b"\n"
        for _ in range(2):  # the second time there is nothing to say or to end
            end_children(before, lines.append, patience_s=0.05)
        found = own.poll()
        own.kill()
        assert (plain.wait(60), deaf.wait(60), found) == (-signal.SIGTERM, -signal.SIGKILL, None)
        assert deaf.stdout.read() == b""  # the shell's own child, which had it too, has ended
        assert [line.split(":")[0] for line in lines] == [
            f"the process {own.pid} goes on after the run, in a session of its own"
        ]
