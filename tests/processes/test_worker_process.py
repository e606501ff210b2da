"""When a process is taken for hung: only where it neither shows itself nor says anything, on virtual time; its end."""

import asyncio
from types import SimpleNamespace

import pytest

from busflow.clock import SimClock
from busflow.launchfile.model.description import ProcessSpec
from busflow.launchfile.model.supervision import Restart, RestartPolicy
from busflow.launchfile.yaml.value import Origin, StatedBy
from busflow.processes import worker_process
from busflow.processes.worker_process import TRANSITIONS, ProcessOutcome, WorkerProcess, WorkerState
from busflow.runner.graph import Graph
from busflow.testing import virtual_time
from busflow.timeouts import Timeouts


class Child:
    """A process that is only there to be ended."""

    pid = 7

    def __init__(self):
        self.killed = self.terminated = False
        self.sent = []

    def kill(self):
        self.killed = True

    def terminate(self):
        self.terminated = True

    def send(self, line):
        self.sent.append(line)


@pytest.fixture
def running():
    """A worker that the others see, and the lines of the log."""

    def running(when=Restart.ON_FAILURE, *, says=({"report": {"nodes": []}},)):
        lines = []
        spec = ProcessSpec("left", Origin(StatedBy.CALLER), restart=RestartPolicy(when))
        graph = Graph([], clock=SimClock(), sinks=(lines.append,))
        worker = WorkerProcess(graph, spec, ["/a", "/b"], "1.sock", environment={}, owner=None)
        worker.child = Child()
        for message in says:
            worker.on_message(message)
        worker.on_presence(there=True)
        return worker, lines

    return running


def events(lines):
    return "\n".join(line.event for line in lines)


@virtual_time
async def test_silent_process_without_token_hangs_and_is_killed(running, golden):
    worker, lines = running()
    await asyncio.sleep(5)
    worker.on_presence(there=False)
    await asyncio.sleep(0.3)
    assert (worker.state, worker.child.killed) == (WorkerState.HANGS, True)
    golden(events(lines))


@virtual_time
async def test_stopped_process_is_logged_within_two_seconds(running):
    worker, lines = running()
    await asyncio.sleep(5)
    worker.on_message({"report": {"nodes": []}})  # and now it is stopped
    await asyncio.sleep(Timeouts().lease)  # when Zenoh gives it up, at the latest
    worker.on_presence(there=False)
    await asyncio.sleep(1.9 - Timeouts().lease)  # the rest is for a machine that is busy
    assert worker.state is WorkerState.HANGS
    assert len(lines) == 1


@virtual_time
async def test_process_that_still_writes_does_not_hang(running):
    worker, lines = running()
    await asyncio.sleep(5)
    worker.on_presence(there=False)  # this process was stopped, and its links have been given up
    for _ in range(20):
        worker.on_message({"report": {"nodes": []}})
        await asyncio.sleep(0.5)
    assert (worker.state, worker.child.killed, lines) == (WorkerState.RUNNING, False, [])
    await asyncio.sleep(2.5)
    assert (worker.state, worker.child.killed) == (WorkerState.HANGS, True), "once it says nothing any more"


@virtual_time
async def test_token_of_the_former_life_kills_no_start(running):
    """On a busy machine it may come and go after the next process was started, which has said nothing yet."""
    worker, _ = running(says=())
    worker.on_presence(there=False)
    await asyncio.sleep(10)
    assert not worker.child.killed


@virtual_time
async def test_process_that_reported_its_end_has_time(running):
    worker, _ = running()
    worker.on_message({"report": {"nodes": []}, "end": {"exit_code": 0}})
    worker.on_presence(there=False)
    await asyncio.sleep(5)
    assert not worker.child.killed
    await asyncio.sleep(10)
    assert worker.child.killed, "one that never exits"


@virtual_time
async def test_process_that_reads_commands_ends_by_one(running):
    worker, _ = running()
    worker.ask_to_stop(130)
    assert (worker.child.sent, worker.child.terminated) == ([b'{"end": 130}\n'], False)


@virtual_time
async def test_process_that_reads_no_commands_gets_sigterm(running):
    worker, _ = running(says=())
    worker.ask_to_stop(130)
    assert (worker.child.sent, worker.child.terminated) == ([], True)


@virtual_time
async def test_process_seen_again_in_time_does_not_hang(running):
    worker, lines = running()
    worker.on_presence(there=False)
    await asyncio.sleep(0.1)
    worker.on_presence(there=True)
    await asyncio.sleep(10)
    assert (worker.state, worker.child.killed, lines) == (WorkerState.RUNNING, False, [])


@virtual_time
async def test_hung_process_without_restart_is_only_logged(running, golden):
    worker, lines = running(Restart.NEVER)
    await asyncio.sleep(5)
    worker.on_presence(there=False)
    await asyncio.sleep(5)
    assert (worker.state, worker.child.killed) == (WorkerState.HANGS, False)
    worker.on_presence(there=True)
    assert worker.state is WorkerState.RUNNING
    golden(events(lines))


RUNNING, STARTING = ({"nodes": [{"name": "/a", "state": state}]} for state in ("running", "starting"))


@virtual_time
async def test_a_loop_that_stands_still_is_restarted(running, golden):
    worker, lines = running()
    await asyncio.sleep(5)
    worker.on_message({"report": RUNNING})
    await asyncio.sleep(30)
    assert (worker.state, worker.child.killed) == (WorkerState.RUNNING, False)
    worker.on_message({"parameters": {}})  # by a thread: it is the loop that sends reports
    await asyncio.sleep(1)
    assert (worker.state, worker.child.killed) == (WorkerState.HANGS, True)
    golden(events(lines))


@virtual_time
async def test_a_loop_that_turns_again_runs(running, golden):
    worker, lines = running(Restart.NEVER)
    worker.on_message({"report": RUNNING})
    await asyncio.sleep(40)
    assert (worker.state, worker.child.killed) == (WorkerState.HANGS, False)
    worker.on_message({"report": RUNNING})
    await asyncio.sleep(0.5)
    assert worker.state is WorkerState.RUNNING
    golden(events(lines))


@pytest.mark.parametrize("message", [{"report": STARTING}, {"report": RUNNING, "debugged": True}])
@virtual_time
async def test_slow_start_and_debugger_are_no_hang(running, message):
    worker, lines = running()
    worker.on_message(message)
    await asyncio.sleep(3600)
    assert (worker.state, worker.child.killed, lines) == (WorkerState.RUNNING, False, [])


@virtual_time
async def test_parameters_and_restart_counts_survive_a_restart(running):
    worker, _ = running()
    worker.on_message({"parameters": {"/a": {"values": {"x": 1}, "set": ["x"], "times": 1}}})
    worker.on_message({"parameters": {"/a": {"values": {"x": 2}, "set": ["x"], "times": 2}}})
    restarted = {"nodes": [_counts("/a", 1, 1, "running"), _counts("/b", 0, 0, "stopped by hand")]}
    worker.on_message({"report": restarted})
    worker.outcomes += [ProcessOutcome(7, restarted, "killed"), ProcessOutcome(8, None, "killed")]
    memory = worker.memory
    assert memory.parameters == {"/a": {"values": {"x": 2}, "set": ["x"], "times": 2}}
    assert (memory.restarts, memory.stopped) == ({"/a": 4, "/b": 2}, ("/b",))


def _counts(name, restarts, starts, state):
    return {"name": name, "restarts": restarts, "started_by_hand": starts, "state": state}


def test_each_state_leads_to_the_end():
    reached, ways = set(), [WorkerState.STARTING]
    while ways:
        state = ways.pop()
        reached.add(state)
        ways += set(TRANSITIONS[state]) - reached
    assert reached == set(WorkerState) == set(TRANSITIONS)
    final = [state for state, following in TRANSITIONS.items() if not following]
    assert final == [WorkerState.ENDED, WorkerState.FAILED]


@pytest.fixture
def unable(monkeypatch):
    """A worker whose process the system cannot start."""

    def fail(*_: object, **__: object) -> None:
        raise OSError("none left")

    def unable(policy):
        spec = ProcessSpec("left", Origin(StatedBy.CALLER), restart=policy)
        owner = SimpleNamespace(first_line=lambda _worker: b"", inherited=())
        return WorkerProcess(Graph([], clock=SimClock()), spec, [], "1.sock", environment={}, owner=owner)

    monkeypatch.setattr(worker_process, "Child", fail)
    return unable


@virtual_time
async def test_process_that_cannot_be_started_has_failed(unable):
    worker = unable(RestartPolicy(Restart.NEVER))
    await worker.live()
    assert (worker.state, len(worker.failures)) == (WorkerState.FAILED, 1)


@virtual_time
async def test_only_a_stop_ends_the_pause_before_a_restart(unable):
    worker = unable(RestartPolicy(Restart.ON_FAILURE, first_s=10, longest_s=10))
    living = asyncio.create_task(worker.live())
    await asyncio.sleep(1)
    worker.on_presence(there=True)  # the token of the former life
    assert worker.state is WorkerState.RESTARTING
    worker.ask_to_stop()
    await living
    assert worker.state is WorkerState.ENDED
