"""Repeats the attacks that once found a fault, each as the test that keeps it out, and prints how each ended.

    python benchmarks/attacks.py [NUMBER …]

Most start a run in processes of its own, and some kill those; all of them take some minutes. The exit code is 1 where
an attack succeeds, or a test was not there.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

TESTS = Path(__file__).parents[1] / "tests"
ATTACKS: dict[int, tuple[str, tuple[str, ...]]] = {
    10: (
        "a publisher's token with an impossible QoS, while a recording runs",
        ("cli/bag/test_record.py::TestLab::test_publisher_with_impossible_qos_ends_no_recording",),
    ),
    11: ("/**a**a**a… on a name of 246 letters", ("bus/test_patterns.py::test_many_wildcards_take_no_longer",)),
    13: (
        "SIGTERM, SIGKILL, SIGSEGV, exit 0 and 3 of a worker, settled and while it starts",
        (
            "processes/test_endings.py::test_every_unasked_end_is_restarted",
            "processes/test_endings.py::test_unasked_end_without_restart_fails_run",
        ),
    ),
    14: ("silent TCP connections to a machine's port", ("wire/machines/test_silent_connections.py",)),
    15: (
        "two runs of one name in two runtime folders",
        (
            "wire/zenoh/test_run_directory.py::test_runs_alike_in_two_folders_are_distinguished",
            "processes/test_survival.py::test_two_runs_of_one_name_stay_apart",
        ),
    ),
    22: (
        "a handler that sleeps, or spins, for ever",
        ("processes/test_survival.py::test_a_handler_that_hangs_is_restarted",),
    ),
    23: (
        "a link between machines that breaks below a transient_local topic",
        (
            "processes/test_machines.py::test_kept_messages_come_once_after_a_broken_link",
            "wire/mirror/test_arrivals.py",
        ),
    ),
    28: (
        "children that a killed process leaves behind",
        (
            "processes/test_endings.py::test_killed_process_leaves_nothing_behind",
            "processes/test_endings.py::test_forked_process_does_not_delay_the_end",
        ),
    ),
}
"""The numbers are those of the list of faults; the words say what the attack does."""
_ENDED = re.compile(r"(\d+) (passed|failed|skipped|error)\w*")


def main() -> int:
    """Run the attacks, print a line for each, and return the exit code."""
    worst = 0
    for number in map(int, sys.argv[1:] or ATTACKS):
        what, tests = ATTACKS[number]
        command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-m", "long or not long", "--no-header"]
        ended = subprocess.run([*command, *tests], cwd=TESTS, capture_output=True, text=True, check=False)  # noqa: S603  # the tests above
        last = (ended.stdout.strip().splitlines() or ["nothing was run"])[-1]
        print(
            f"{number:>3}  {'held' if ended.returncode == 0 else 'NOT HELD':<8}  {last.strip('= '):<40}  {what}",
            flush=True,
        )
        worst = max(worst, int(ended.returncode != 0 or not _ENDED.search(last)))
        if ended.returncode:
            print(ended.stdout[-3000:])
    return worst


if __name__ == "__main__":
    sys.exit(main())
