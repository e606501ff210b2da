"""A fresh interpreter finds what a plugin's file defines: a pool's process, and any that unpickles it."""

import os
import pickle
import subprocess
import sys

import pytest

from busflow.errors import PluginError
from busflow.node.plugins import load

PLUGIN = """
import asyncio
import multiprocessing
from concurrent.futures import ProcessPoolExecutor

from busflow import Message, Node
from .beside import Box


class Reading(Message):
    value: float = 0.0


def doubled(reading: Reading) -> tuple[Reading, Box]:
    return Reading(value=2 * reading.value), Box()


class Pooled(Node):
    pass
"""
POOL = """
import multiprocessing, sys
from concurrent.futures import ProcessPoolExecutor
from busflow.node.plugins import load

if __name__ == "__main__":
    file = sys.modules[load("pooled", [sys.argv[1]]).__module__]
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context(sys.argv[2])) as pool:
        reading, box = pool.submit(file.doubled, file.Reading(value=2)).result()
    print(type(reading) is file.Reading, reading.value, type(box) is file.Box)
"""


@pytest.fixture(params=["plugins", "Mes plugins é_1"])
def folder(request, tmp_path):
    folder = tmp_path / request.param
    folder.mkdir()
    (folder / "pooled.py").write_text(PLUGIN)
    (folder / "beside.py").write_text("class Box:\n    pass\n")
    return folder


@pytest.mark.parametrize(
    "method", [each for each in ("spawn", "forkserver", "fork") if sys.platform != "win32" or each == "spawn"]
)
def test_a_pool_runs_a_function_of_the_file(method, folder, tmp_path, directory):
    (tmp_path / "pool.py").write_text(POOL)
    command = [sys.executable, "pool.py", str(folder), method]
    env = {**os.environ, "TMPDIR": str(directory)}  # the server that forks has its socket there
    ended = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, timeout=60)
    assert (ended.stdout, ended.returncode) == ("True 4.0 True\n", 0), ended.stderr


def test_a_pickled_message_is_read_by_a_fresh_interpreter(folder):
    module = sys.modules[load("pooled", [folder]).__module__]
    data = pickle.dumps(module.Reading(value=3))
    program = "import pickle, sys; print(pickle.load(sys.stdin.buffer).value)"
    ended = subprocess.run([sys.executable, "-c", program], input=data, capture_output=True, timeout=60)
    assert ended.stdout.split() == [b"3.0"], ended.stderr.decode()


def test_the_init_of_a_folder_runs_first(folder):
    (folder / "__init__.py").write_text("RATE_HZ = 50\n")
    (folder / "paced.py").write_text(
        "from . import RATE_HZ\nfrom busflow import Node\nclass Paced(Node):\n    rate = RATE_HZ\n"
    )
    data = pickle.dumps(load("paced", [folder]))
    program = "import pickle, sys; print(pickle.load(sys.stdin.buffer).rate)"
    ended = subprocess.run([sys.executable, "-c", program], input=data, capture_output=True, timeout=60)
    assert ended.stdout.split() == [b"50"], ended.stderr.decode()


def test_a_folder_that_is_gone_is_not_found(folder):
    data = pickle.dumps(load("pooled", [folder]))
    folder.rename(folder.with_name("moved"))
    program = "import pickle, sys; pickle.load(sys.stdin.buffer)"
    ended = subprocess.run([sys.executable, "-c", program], input=data, capture_output=True, text=False, timeout=60)
    assert b"ModuleNotFoundError" in ended.stderr


def test_a_neighbour_s_folder_is_not_found_by_a_relative_import(folder):
    (folder / "above.py").write_text("from ..beside import Box\n")
    with pytest.raises(PluginError):
        load("above", [folder])
