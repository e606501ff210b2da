"""The pytest plugin: marked tests run on virtual time, beside the async plugins that people have."""

import re
import sys
from importlib.metadata import entry_points

import pytest

from busflow.runner import standard_error
from tests.new_interpreter import printed_by

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
from busflow.testing import VirtualLoop


class Nothing(Node):
    pass


class AnyioLoop(VirtualLoop):
    pass


@pytest.fixture
def anyio_backend():
    return "asyncio", {"loop_factory": AnyioLoop}


@pytest.mark.asyncio
async def test_of_pytest_asyncio(harness):
    async with harness(Nothing) as lab:
        await lab.advance(3600)


@pytest.mark.anyio
async def test_of_anyio(harness):
    assert type(asyncio.get_running_loop()) is AnyioLoop
    async with harness(Nothing) as lab:
        await anyio.sleep(3600)
        assert lab.clock.seconds() == 3600
"""

FACTORIES = """
from busflow.testing import VirtualLoop


def pytest_asyncio_loop_factories(config, item):
    return {"virtual": VirtualLoop}
"""


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Runs pytest in this process on a file of tests; returns its exit code, and what it printed."""

    def run_tests(tests, *options):
        (tmp_path / "test_it.py").write_text(tests)
        (tmp_path / "pytest.ini").write_text(
            "[pytest]\naddopts = --strict-markers -p no:cacheprovider -p no:xdist -p no:cov -p no:faulthandler\n"
            "filterwarnings = error\nasyncio_default_fixture_loop_scope = function\n"
        )
        monkeypatch.chdir(tmp_path)
        monkeypatch.delenv("CI", raising=False)  # with it pytest prints each error a second time, in its summary
        monkeypatch.delitem(sys.modules, "test_it", raising=False)
        monkeypatch.delitem(sys.modules, "conftest", raising=False)
        monkeypatch.setattr(standard_error, "descriptor", 2)  # the outer pytest's, which the inner one would close
        code = pytest.main(["-W", "ignore:Unknown config option", *options])
        return code, capsys.readouterr().out

    return run_tests


@pytest.mark.parametrize("mode", ["strict", "auto"])
def test_marked_tests_run_beside_pytest_asyncio_and_anyio(run, mode):
    code, output = run(TESTS + UNMARKED + OTHERS, f"--asyncio-mode={mode}")
    assert "9 passed, 1 xfailed" in output, output
    assert code == 0, output


def test_marked_tests_run_beside_anyio_s_auto_mode(run):
    code, output = run(TESTS, "--anyio-mode=auto", "-p", "no:asyncio")
    assert "5 passed, 1 xfailed" in output, output
    assert code == 0


def test_marked_tests_need_no_other_plugin(run):
    code, output = run(TESTS + UNMARKED, "-p", "no:asyncio", "-p", "no:anyio")
    assert "7 passed, 1 xfailed" in output, output
    assert code == 0


def test_unhandled_async_test_gets_the_busflow_hint(run):
    test = "async def test_a():\n    pass\n\ndef test_b():\n    raise ValueError('mine')\n"
    code, output = run(test, "-p", "no:asyncio", "-p", "no:anyio")
    assert ": write @virtual_time above it" in output
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


def test_failure_shows_the_lines_of_the_user(run):
    _, output = run(FAILING)
    assert "request.gear == 1" in output
    assert 'await lab.call(Trigger, "park")' in output
    assert 'Response(success="yes")' in output
    assert not re.search(r"^\S*(busflow|pydantic)/.*\.py:\d", output, re.MULTILINE), output
    assert "<string>" not in output
    assert "busflow/bus/services" in run(FAILING, "--full-trace")[1]


def test_the_others_can_be_given_the_virtual_loop(run, tmp_path):
    (tmp_path / "conftest.py").write_text(FACTORIES)
    code, output = run(LOOPS_OF_OTHERS)
    assert "2 passed" in output, output
    assert code == 0


def test_replayed_seed_is_reported_and_used(run, monkeypatch):
    test = "async def test(harness):\n    async with harness('busflow_none.yaml'):\n        pass\n"
    monkeypatch.setenv("BUSFLOW_SEED", "7")
    _, output = run(test)
    assert "busflow: BUSFLOW_SEED=7" in output
    monkeypatch.delenv("BUSFLOW_SEED")
    _, output = run(test)
    assert "BUSFLOW_SEED" not in output


def test_the_plugin_is_found_by_pytest():
    assert [each.value for each in entry_points(group="pytest11", name="busflow")] == [PLUGIN]


def test_the_plugin_costs_pytest_nothing_at_its_start():
    program = (
        "import sys, pytest; before = set(sys.modules); import busflow.testing.plugin; "
        "print(sorted(name for name in set(sys.modules) - before if not name.startswith('busflow')))"
    )
    assert printed_by(program) == "[]"
