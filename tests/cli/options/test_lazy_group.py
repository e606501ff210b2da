"""The garbage collector is off while a command imports modules, and goes on as before."""

import gc
import subprocess
import sys
from pathlib import Path

import pytest

from busflow.cli.options.lazy_group import importing

ROOT = Path(__file__).parents[3]

pytestmark = pytest.mark.usefixtures("unfrozen")


def collections() -> int:
    return sum(each["collections"] for each in gc.get_stats())


def test_nothing_is_collected_meanwhile():
    with importing():
        before = collections()
        kept = [[] for _ in range(10_000)]
        assert collections() == before
    assert gc.isenabled()
    assert len(kept) == 10_000


def test_imported_objects_are_not_collected_again():
    with importing():
        kept = [[] for _ in range(10_000)]
    old = {*map(id, gc.get_objects(generation=2))}
    assert all(id(each) in old for each in kept)
    assert gc.get_freeze_count() == 0


def test_collector_resumes_after_a_failed_import():
    with pytest.raises(ImportError), importing():
        raise ImportError
    assert gc.isenabled()


def test_a_collector_that_was_turned_off_stays_so():
    gc.disable()
    with importing():
        pass
    assert not gc.isenabled()


def test_frozen_objects_stay_frozen():
    gc.freeze()
    with importing():
        assert gc.isenabled()
    assert gc.get_freeze_count() > 0


@pytest.mark.parametrize("command", ["run configs/lab1.yaml --sim --for 1ms", "check configs/lab1.yaml"])
def test_commands_import_without_garbage_collection(command: str):
    """Collections are counted when the last module is imported: some belong to Python's own start."""
    code = (
        "import gc, sys, busflow.cli\n"
        "seen = []\n"
        "class Watch:\n"
        "    def find_spec(self, name, *rest):\n"
        "        if name == 'numpy': seen.append(gc.isenabled())\n"
        "sys.meta_path.insert(0, Watch())\n"
        "code = busflow.cli.main(sys.argv[1:])\n"
        "print(seen, gc.isenabled(), file=sys.stderr)\n"
        "sys.exit(code)"
    )
    line = [sys.executable, "-c", code, *command.split()]
    done = subprocess.run(line, capture_output=True, encoding="utf-8", cwd=ROOT)
    assert done.returncode == 0
    assert done.stderr.splitlines()[-1] == "[False] True"
