"""The list of faults that a run has to survive: for each the test that injects it, or why it does not apply (yet)."""

import ast
import asyncio
import json
from pathlib import Path

import pytest

from busflow import Graph, Message, Node, publisher, subscription, supervised, timer
from busflow.clock import SimClock
from busflow.testing import virtual_time

TESTS = Path(__file__).parent
CASES = json.loads((TESTS / "cases" / "n_faults.json").read_text(encoding="utf-8"))["cases"]
SHOWN = {
    "node/raise-callback": "test_faults.py::test_failures_lose_no_message_of_others",
    "node/raise-timer": "node/test_supervision.py::test_a_node_failing_too_often_ends_the_run",
    "node/raise-service": "bus/services/test_server.py::test_handler_error_reaches_caller_and_server_log",
    "node/exception-in-error-hook": "runner/test_supervisor.py::test_any_exception_of_a_node_is_its_failure",
    "node/block-loop": "runner/test_watchdog.py::test_blocking_handler_is_named_with_its_stack",
    "node/infinite-await": "test_faults.py::test_endless_async_handler_blocks_no_other",
    "node/slow-subscriber": "bus/test_subscription.py::test_queue_overflows_during_an_async_handler",
    "node/reentrant": "runner/test_graph.py::test_self_feeding_node_does_not_delay_timers",
    "node/threads": "runner/test_graph.py::test_messages_from_threads_are_ordered_and_counted",
    "node/signal-handler": "e2e/test_ctrl_c.py::test_node_signal_changes_nothing_for_ctrl_c",
    "node/gc-tasks": "runner/test_graph.py::test_failing_spawned_task_fails_its_node",
}
SKIPPED = {
    "node/block-c": "needs another process to notice: later",
    "node/stdout": "a node in a process of its own: later",
    "proc/": "nodes in processes of their own: later; what the command survives is in tests/e2e and tests/cli",
    "rec/": "recording: later",
    "time/": "bus/test_timer.py, test_clock.py and runner/test_following.py",
    "cfg/change": "the launch file is read once; live edits: later",
    "cfg/param-storm": "node/test_parameter_store.py",
    "net/": "between machines: later",
    "load/": "benchmarks, not tests",
    "data/": "bus/test_names.py, interfaces/test_arrays.py, interfaces/test_fields.py and interfaces/test_message.py",
    "api/misuse": "bus/test_publisher.py, node/test_node.py and runner/test_supervisor.py",
    "cli/": "tests/e2e and tests/cli",
}


def test_each_fault_is_injected_or_has_a_reason():
    assert [case["id"] for case in CASES if not case["id"].startswith((*SHOWN, *SKIPPED))] == []


@pytest.mark.parametrize("where", SHOWN.values())
def test_what_is_said_to_inject_it_exists(where):
    file, name = where.split("::")
    tree = ast.parse((TESTS / file).read_text(encoding="utf-8"))
    assert name in {each.name for each in tree.body if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef)}


class Number(Message, package="test"):
    data: int = 0


class Source(Node):
    numbers = publisher(Number, "numbers")

    @timer(0.01)
    def tick(self) -> None:
        self.numbers.publish(Number(data=self.tick.fired))


class Hearing(Node):
    @subscription("numbers")
    def on_number(self, number: Number) -> None:
        received.append(number.data)


received: list[int] = []


@virtual_time
async def test_failures_lose_no_message_of_others():
    class Third(Node):
        @subscription("numbers")
        def third(self, number: Number) -> None:
            if number.data % 3 == 0:
                raise ValueError(number.data)

    received.clear()
    graph = Graph([Source, Hearing, supervised(Third, restart="on-failure")], clock=SimClock())
    async with graph:
        await asyncio.sleep(1.005)
        lines = {line.node: line for line in graph.bus.ledger()}
        assert received == list(range(1, 101))
        assert lines["/hearing"].dropped == 0
        assert lines["/third"].published == 100
        node = next(node for node in graph.report().nodes if node.name == "/third")
        assert node.failures == node.restarts == graph.log.counts["error"] >= 3


@virtual_time
async def test_endless_async_handler_blocks_no_other():
    class Stuck(Node):
        @subscription("numbers")
        async def wait(self, _number: Number) -> None:
            await asyncio.Event().wait()

    received.clear()
    graph = Graph([Source, Hearing, Stuck], clock=SimClock())
    async with graph:
        await asyncio.sleep(1.005)
        stuck = next(line for line in graph.bus.ledger() if line.node == "/stuck")
        assert (len(received), stuck.delivered, stuck.queued, stuck.dropped) == (100, 1, 10, 89)
    assert asyncio.get_running_loop().time() < 1.1
