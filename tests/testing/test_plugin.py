"""The pytest plugin: marked tests run on virtual time, beside the async plugins that people have."""

import re
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from tests.new_interpreter import printed_by

ROOT = Path(__file__).parents[2]
PLUGIN = "busflow.testing.plugin"

TESTS = """
import asyncio

import anyio
import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow import Node, publisher, timer
from busflow.msgs.std_msgs import Int64


class Counter(Node):
    numbers = publisher(Int64, "numbers")

    @timer(0.1)
    def tick(self) -> None:
        self.numbers.publish(Int64(data=len(self.name)))


def virtual():
    return type(asyncio.get_running_loop()).__name__ == "VirtualLoop"


@pytest.mark.virtual_time
async def test_with_the_marker():
    await asyncio.sleep(3600)
    assert virtual()


@pytest.mark.virtual_time(horizon_s=10)
@pytest.mark.xfail(raises=Exception, strict=True)
async def test_with_a_horizon():
    await asyncio.sleep(11)


RUNS = []


@pytest.mark.explore(schedules=7)
async def test_exploring(harness):
    RUNS.append(1)
    async with harness(Counter) as lab:
        await lab.advance(1)


def test_explored():
    assert len(RUNS) == 7


@pytest.mark.virtual_time
@given(st.integers())
async def test_with_hypothesis(number):
    await asyncio.sleep(abs(number) % 100)
    assert virtual()


def test_that_is_not_async(harness):
    assert callable(harness)
"""

UNMARKED = """

@pytest.fixture
def name(tmp_path):
    return "left"


async def test_with_the_fixture(harness, name):
    async with harness(Counter(name=name)) as lab:
        await lab.advance(600)
        assert len(lab.received("numbers")) == 6000


class TestMethods:
    async def test_with_the_fixture(self, harness):
        async with harness(Counter) as lab:
            await lab.advance(1)
"""

OTHERS = """

@pytest.mark.asyncio
async def test_of_pytest_asyncio():
    await asyncio.sleep(0.001)
    assert not virtual()


@pytest.mark.anyio
@pytest.mark.parametrize("anyio_backend", ["asyncio"])
async def test_of_anyio(anyio_backend):
    await anyio.sleep(0.001)
    assert not virtual()
"""

LOOPS_OF_OTHERS = """
import asyncio

import anyio
import pytest

from busflow import Node
from busflow.testing import VirtualLoop, harness


class Nothing(Node):
    pass


@pytest.fixture
def anyio_backend():
    return "asyncio", {"loop_factory": VirtualLoop}


@pytest.mark.asyncio
async def test_of_pytest_asyncio(harness):
    async with harness(Nothing) as lab:
        await lab.advance(3600)


@pytest.mark.anyio
async def test_of_anyio():
    async with harness(Nothing) as lab:
        await anyio.sleep(3600)
        assert lab.clock.seconds() == 3600
"""

FACTORIES = """
from busflow.testing import VirtualLoop


def pytest_asyncio_loop_factories(config, item):
    return {"virtual": VirtualLoop}
"""


def run(folder, tests, *options, **environment):
    """How many tests of a file passed, and what pytest printed."""
    (folder / "test_it.py").write_text(tests)
    (folder / "pytest.ini").write_text(
        "[pytest]\naddopts = --strict-markers -p no:cacheprovider\nfilterwarnings = error\n"
        "asyncio_default_fixture_loop_scope = function\n"
    )
    command = [sys.executable, "-m", "pytest", "-W", "ignore:Unknown config option", *options]
    ours = {"PYTHONPATH": str(ROOT), **environment}  # the plugin of this tree, whichever is installed
    done = subprocess.run(command, cwd=folder, env=ours, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.parametrize("mode", ["strict", pytest.param("auto", marks=pytest.mark.long)])
def test_marked_tests_run_beside_pytest_asyncio_and_anyio(tmp_path, mode):
    code, output = run(tmp_path, TESTS + UNMARKED + OTHERS, f"--asyncio-mode={mode}")
    assert "9 passed, 1 xfailed" in output, output
    assert code == 0, output


@pytest.mark.long
def test_marked_tests_run_beside_anyio_s_auto_mode(tmp_path):
    code, output = run(tmp_path, TESTS, "--anyio-mode=auto", "-p", "no:asyncio")
    assert "5 passed, 1 xfailed" in output, output
    assert code == 0


@pytest.mark.long
def test_marked_tests_need_no_other_plugin(tmp_path):
    code, output = run(tmp_path, TESTS + UNMARKED, "-p", "no:asyncio", "-p", "no:anyio")
    assert "7 passed, 1 xfailed" in output, output
    assert code == 0


@pytest.mark.long
def test_unhandled_async_test_gets_the_busflow_hint(tmp_path):
    test = "async def test_a():\n    pass\n\ndef test_b():\n    raise ValueError('mine')\n"
    code, output = run(tmp_path, test, "-p", "no:asyncio", "-p", "no:anyio")
    assert "busflow runs an async test on virtual time: write @virtual_time above it" in output
    assert output.count("fixture harness") == 1, "of the other failure nothing is said"
    assert "2 failed" in output, output
    assert code == 1


FAILING = """
from busflow import Node, service
from busflow.msgs.std_srvs import Trigger
from busflow.testing import harness, virtual_time


class Wheels(Node):
    @service(Trigger, "park")
    def on_park(self, request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=request.gear == 1)


@virtual_time
async def test_parks():
    async with harness(Wheels) as lab:
        await lab.call(Trigger, "park")


def test_of_a_message():
    Trigger.Response(success="yes")
"""


def test_failure_shows_the_lines_of_the_user(tmp_path):
    _, output = run(tmp_path, FAILING)
    assert "request.gear == 1" in output
    assert 'await lab.call(Trigger, "park")' in output
    assert 'Response(success="yes")' in output
    assert not re.search(r"^\S*(busflow|pydantic)/.*\.py:\d", output, re.MULTILINE), output
    assert "<string>" not in output
    assert "busflow/bus/services" in run(tmp_path, FAILING, "--full-trace")[1]


@pytest.mark.long
def test_the_others_can_be_given_the_virtual_loop(tmp_path):
    (tmp_path / "conftest.py").write_text(FACTORIES)
    code, output = run(tmp_path, LOOPS_OF_OTHERS)
    assert "2 passed" in output, output
    assert code == 0


@pytest.mark.long
def test_replayed_seed_is_reported_and_used(tmp_path):
    test = "async def test(harness):\n    async with harness('busflow_none.yaml'):\n        pass\n"
    _, output = run(tmp_path, test, BUSFLOW_SEED="7")
    assert "busflow: BUSFLOW_SEED=7" in output
    _, output = run(tmp_path, test)
    assert "BUSFLOW_SEED" not in output


def test_the_plugin_is_found_by_pytest():
    assert [each.value for each in entry_points(group="pytest11", name="busflow")] == [PLUGIN]


def test_the_plugin_costs_pytest_nothing_at_its_start():
    program = (
        "import sys, pytest; before = set(sys.modules); import busflow.testing.plugin; "
        "print(sorted(name for name in set(sys.modules) - before if not name.startswith('busflow')))"
    )
    assert printed_by(program) == "[]"
