"""A program that has a run of a name until its input ends; it prints where."""

import sys

from busflow.wire.zenoh.run_directory import RunCard, RunDirectory

directory = RunDirectory.claim(sys.argv[1])
directory.write_card(RunCard(directory.path.name, 1, 1))
print(directory.path, flush=True)
sys.stdin.read()
