"""The lab's recording is the same in every process, and what it holds in every Python."""

import hashlib
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from busflow.recording.bag.bag import Bag

ROOT = Path(__file__).parents[3]
GOLDEN = "254000d6b18c92960178f9f4cc5a3d0d00bccda96670fe42809d70904e5793e2"
"""What ten seconds of the lab come to with seed 0. It changes when the lab, its messages or the log do: look why."""
LAB = """
import sys
from busflow.testing import harness, virtual_time

@virtual_time
async def main():
    async with harness("configs/lab1.yaml", seed=0, record=sys.argv[1]) as lab:
        await lab.advance(10)

main()
"""
NEEDS = "import anyio, mcap, numpy, pydantic, yaml"


def lab(path, *, python=sys.executable, hash_seed="0"):
    environment = {"PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(ROOT)}
    subprocess.run([python, "-c", LAB, str(path)], cwd=ROOT, env=environment, capture_output=True, check=True)
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return lab(tmp_path_factory.mktemp("golden") / "run.mcap")


def digest(path):
    with Bag(path) as bag:
        found = bag.digest()
        assert bag.complete
    return found


def test_the_lab_s_recording_is_known(recording):
    assert digest(recording) == GOLDEN


@pytest.mark.long
def test_the_file_is_the_same_in_every_process(recording, tmp_path):
    again = lab(tmp_path / "again.mcap", hash_seed="1")
    assert hashlib.sha256(again.read_bytes()).digest() == hashlib.sha256(recording.read_bytes()).digest()


@pytest.mark.parametrize("python", [f"python3.{minor}" for minor in range(11, 15) if minor != sys.version_info.minor])
def test_the_content_is_the_same_in_every_python(recording, tmp_path, python):
    found = shutil.which(python)
    if found is None or subprocess.run([found, "-c", NEEDS], capture_output=True).returncode:
        pytest.skip(f"no {python} with what busflow needs")
    assert digest(lab(tmp_path / "other.mcap", python=found)) == digest(recording)


@pytest.mark.long
def test_another_seed_is_another_recording(recording, tmp_path):
    other = tmp_path / "other.mcap"
    program = LAB.replace("seed=0", "seed=1")
    subprocess.run([sys.executable, "-c", program, str(other)], cwd=ROOT, env={"PYTHONPATH": str(ROOT)}, check=True)
    assert digest(other) != digest(recording)


def test_recording_holds_nothing_of_the_machine(recording):
    with Bag(recording) as bag:
        told = repr((bag.facts, bag.ledger, [channel.definition for channel in bag.channels]))
        texts = [bytes(entry.payload) for entry in bag.entries()]
    assert str(Path.home()) not in told
    assert str(ROOT) not in told
    assert str(recording.parent) not in told
    assert not any(str(ROOT).encode() in text for text in texts)
