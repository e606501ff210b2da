"""What several test files need: ends of topics that belong to no node, on virtual time."""

import asyncio
import gc
import os
import random
import shutil
import signal
import sys
import tempfile
from collections.abc import AsyncIterator, Callable, Generator, Iterator
from contextlib import ExitStack, asynccontextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from busflow import timeouts
from busflow.bus.bus import Bus
from busflow.bus.endpoint import Endpoint
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.bus.subscription import Subscription
from busflow.clock import SimClock
from busflow.errors import UnknownType
from busflow.interfaces.encoding.builtin_types import DATA, SOURCES, read
from busflow.msgs.std_msgs import Int64
from busflow.wire.zenoh.run_directory import find_run, runs
from tests.extras import require_extra
from tests.golden import forget_removed, golden  # noqa: F401  # a fixture of every test

# How long an example takes, or is drawn, says how busy the machine is.
ON_ANY_MACHINE = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("seeded", ON_ANY_MACHINE, derandomize=True, max_examples=25)
"""The same few examples each time: whether a change passes does not depend on luck."""
settings.register_profile("random", ON_ANY_MACHINE, max_examples=500)
"""Others each time, and twenty times as many: `pytest --hypothesis-profile=random`."""
settings.load_profile("seeded")

# In the background a shell makes the tests and their processes ignore Ctrl-C; `nohup` makes them ignore SIGHUP.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    # A handler of our own goes on with the tests; the processes that they start do not inherit it and have the default.
    signal.signal(signal.SIGHUP, lambda *_: None)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--shuffle", action="store_true", help="run the tests in a random order, whose seed is printed")
    parser.addoption("--update", action="store_true", help="write golden texts anew, in this process")
    parser.addoption("--shuffle-seed", type=int, metavar="SEED", help="run the tests in that order again")


def pytest_configure(config: pytest.Config) -> None:
    """Describe messages that were changed, and draw the seed of a shuffle once, before there are workers."""
    if not hasattr(config, "workerinput"):
        describe_changed_messages()
    if config.option.update:
        config.option.numprocesses = 0  # two workers would write one golden file
        config.option.dist, config.option.tx = "no", []
    if hasattr(config, "workerinput"):
        config.option.shuffle_seed = config.workerinput["shuffle_seed"]
    elif config.option.shuffle and config.option.shuffle_seed is None:
        config.option.shuffle_seed = random.SystemRandom().randrange(1_000_000)


def describe_changed_messages() -> None:
    """Do for a clone what `pip install -e .` does, so that tests see the messages as their sources say."""
    try:
        read(DATA, SOURCES)
    except UnknownType:
        import_module("hatch_build").describe_messages()


def import_a_share(config: pytest.Config, worker: int, workers: int) -> None:
    """Import a worker's share of the test files, so that the first run does not compile each of them once per worker.

    The workers then collect what the others have compiled. An error is left to the collection, which reports it.
    """
    files = sorted(file for argument in config.args for file in Path(argument).resolve().rglob("test_*.py"))
    for file in files[worker * len(files) // workers : (worker + 1) * len(files) // workers]:
        with suppress(Exception, pytest.skip.Exception):
            import_module(".".join(file.relative_to(config.rootpath).with_suffix("").parts))


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """Collect tests without the garbage collector, and freeze them: each full collection would look at them all.

    Not before: what is imported earlier counts for no coverage.
    """
    gc.disable()
    try:
        if (of_worker := getattr(session.config, "workerinput", None)) is not None:
            import_a_share(session.config, int(of_worker["workerid"][2:]), of_worker["workercount"])
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


@pytest.fixture
def unfrozen() -> Iterator[None]:
    """The garbage collector as a program finds it: on, with nothing frozen."""
    gc.unfreeze()
    gc.enable()
    yield
    gc.unfreeze()
    gc.enable()
    gc.freeze()


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    node.workerinput["shuffle_seed"] = node.config.option.shuffle_seed


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    if (seed := config.option.shuffle_seed) is not None:
        terminalreporter.write_line(f"shuffled: the same order again with --shuffle-seed={seed}")


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One worker more than there are processors, since many tests wait for processes that they have started.

    A single file's tests run in this process: most take less time than workers take to start.
    """
    paths = {Path(argument.partition("::")[0]) for argument in config.args}
    if len(paths) == 1 and all(path.is_file() for path in paths):
        return 0
    processors = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return processors + 1


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out long tests, unless `-m` or a test's own name asks for them, and put files with slow tests first.

    No slow test is then alone at the end. Files stay whole, because their tests share fixtures.
    """
    if config.option.update and not any("::" in argument for argument in config.args):
        forget_removed(items)
    if not config.option.markexpr and not any("::" in argument for argument in config.args):
        config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker("long")])
        items[:] = [item for item in items if not item.get_closest_marker("long")]
    if config.option.shuffle_seed is not None:
        shuffle(items, random.Random(config.option.shuffle_seed))
        return
    slow = {item.path for item in items if item.get_closest_marker("timeout")}
    items.sort(key=lambda item: item.path not in slow)


def pytest_runtest_setup(item: pytest.Item) -> None:
    for mark in item.iter_markers("needs"):
        require_extra(mark.args[0])


def shuffle(items: list[pytest.Item], order: random.Random) -> None:
    """Shuffle the files, and the tests within each: their fixtures are still made once for a file."""
    files = sorted({item.path for item in items})
    order.shuffle(files)
    place = {file: index for index, file in enumerate(files)}
    order.shuffle(items)
    items.sort(key=lambda item: place[item.path])


class Bench:
    """A bus that delivers, and ends of topics on it without nodes; made within a test on virtual time."""

    def __init__(self, *, explore=None):
        self.bus = Bus(SimClock(), explore=explore)
        self.bus.open()
        self.failures = []
        self.pumps = []

    def publisher(self, topic="/number", *, message_type=Int64, node="/source", **qos):
        endpoint = Endpoint(node, topic, message_type, QoS(**qos), f"the publisher of {node}", topic)
        publisher = Publisher(message_type, endpoint)
        self.bus.attach_publisher(publisher)
        return publisher

    def subscription(self, handler=None, topic="/number", *, message_type=Int64, node="/sink", **qos):
        endpoint = Endpoint(node, topic, message_type, QoS(**qos), f"the subscription of {node}", topic)
        subscription = Subscription(message_type, endpoint, handler)
        self.bus.attach_subscription(subscription, lambda error, message: self.failures.append((error, message)))
        pump = subscription.open()
        if pump is not None:
            self.pumps.append(asyncio.create_task(pump))
        return subscription

    def balanced(self):
        """Whether every line of the ledger accounts for every message."""
        return all(line.published == line.delivered + line.dropped + line.queued for line in self.bus.ledger())


@pytest.fixture(scope="session")
def make_bench():
    return Bench


@pytest.fixture
def nothing_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """No plugin of an installed distribution, such as the project's own assistant."""
    monkeypatch.setattr("busflow.node.plugins.entry_points", lambda _group: ())


@pytest.fixture
def directory() -> Iterator[Path]:
    """A folder for sockets, whose path is short enough wherever temporary files are."""
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as name:
        yield Path(name)


@pytest.fixture(scope="session", autouse=True)
def runtime_folder() -> Iterator[Path]:
    """Where the runs of these tests are found, and no others; its path is short enough for a socket."""
    folder = Path(tempfile.mkdtemp(prefix="bf", dir="/tmp"))  # the default is too long for a socket on macOS
    os.environ["BUSFLOW_RUNTIME_DIR"] = str(folder)
    yield folder
    del os.environ["BUSFLOW_RUNTIME_DIR"]
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="session", autouse=True)
def unhurried() -> Iterator[None]:
    """Set limits that a busy machine would exceed, here and in all processes that the tests start.

    A run gets 20 s to stop: one that takes longer ends its process by force, and here all tests with it.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(timeouts.VARIABLE, "grace=20,import_warning=inf,processes_warning=inf,processes_start=inf")
        patch.setattr(timeouts, "current", timeouts.stated(os.environ[timeouts.VARIABLE], timeouts.Timeouts()))
        yield


@pytest.fixture
def limits(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """`limits(grace=0.1)`: limits of real time for this test."""
    return lambda **changes: monkeypatch.setattr(timeouts, "current", timeouts.current.but(**changes))


def children() -> set[str]:
    """The living processes that this one has started, each with its command, where the system lists them."""
    found: set[str] = set()
    for task in Path("/proc/self/task").glob("*/children"):
        with suppress(OSError):
            for pid in task.read_text().split():
                command = Path(f"/proc/{pid}/cmdline").read_bytes()  # empty once it has ended
                if command and b"multiprocessing.resource_tracker" not in command:  # which Python keeps for good
                    found.add(f"{pid}: {command.replace(bytes(1), b' ').decode(errors='replace')[:200]}")
    return found


def listening() -> set[str]:
    """The TCP addresses at which this process listens, as Linux writes them."""
    own: set[str] = set()
    for each in Path("/proc/self/fd").glob("*"):
        with suppress(OSError):
            own.add(str(each.readlink()))
    files = [file for name in ("tcp", "tcp6") if (file := Path("/proc/self/net", name)).exists()]
    rows = [line.split() for file in files for line in file.read_text().splitlines()[1:]]
    return {row[1] for row in rows if row[3] == "0A" and f"socket:[{row[9]}]" in own}


def things(runtime: Path, root: Path) -> dict[str, set[str]]:
    """Everything that a file of tests could leave behind; caches may come and go."""
    runs()  # as any command does, this removes the directories of killed runs
    return {
        "processes": children(),
        "sockets that listen": listening(),
        "files of runs": {path.name for path in runtime.iterdir()} - {".lock"},
        "files of the project": {path.name for path in root.iterdir() if not path.name.startswith((".", "__"))},
    }


@pytest.fixture(scope="session")
def lasting() -> set[int]:
    """The processes that are meant to last as long as the tests do: a fixture that starts one adds its number."""
    return set()


@pytest.fixture(scope="module", autouse=True)
def nothing_is_left(runtime_folder: Path, lasting: set[int], pytestconfig: pytest.Config) -> Iterator[None]:
    """Fail if a file of tests leaves a process, a socket or a file behind, or shortens the path of modules; name it."""
    before, path = things(runtime_folder, pytestconfig.rootpath), list(sys.path)
    yield
    assert not (lost := set(path) - {*sys.path}), f"the tests of this file take {sorted(lost)} from sys.path"
    after = things(runtime_folder, pytestconfig.rootpath)
    kept = {each for each in after["processes"] if int(each.partition(":")[0]) in lasting}
    left = {kind: sorted(now - before[kind] - kept) for kind, now in after.items()}
    assert not any(left.values()), f"the tests of this file leave behind {left}"


LOOK_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""


class Looked:
    """A graph of this process that runs, and a peer that has joined it."""

    def __init__(self, graph: Any, peer: Any) -> None:
        self.graph, self.peer = graph, peer

    async def ask(self, act: Callable[..., Any], *arguments: Any, **words: Any) -> Any:
        """Have the peer do something, while the graph's loop goes on."""
        return await asyncio.to_thread(act, *arguments, **words)

    async def publish(self, topic: str, *values: Any, type_name: str = "std_msgs/msg/Int64", **words: Any) -> None:
        """Have the peer advertise a topic, publish these values, and leave; a number is the `data` of a message."""
        type_ = await self.ask(self.peer.type, type_name)

        def act() -> None:
            with self.peer.advertise(topic, type_, **words) as speaker:
                for value in values:
                    speaker.publish({"data": value} if isinstance(value, int) else value)

        await self.ask(act)

    @asynccontextmanager
    async def listening(self, topic: str) -> AsyncIterator[Callable[[], Any]]:
        """A function to await the next message that the peer receives, once the graph knows that it listens."""
        view = (await self.ask(self.peer.graph)).topic(topic)
        with ExitStack() as ending:
            listener = await self.ask(ending.enter_context, self.peer.listen(view))
            await self.ask(self.peer.settle)
            yield lambda: self.ask(listener.get, LOOK_S)

    async def until(self, condition: Callable[[], Any]) -> Any:
        """Wait until something is so, which the loop has to come round to."""
        async with asyncio.timeout(LOOK_S):
            while not (found := condition()):  # noqa: ASYNC110  # it is others who make it so, with no event to set
                await asyncio.sleep(0.005)
        return found


@pytest.fixture
def looked_at():
    """`async with looked_at(*nodes) as looked`: a graph that a peer looks into."""

    @asynccontextmanager
    async def start(*nodes: Any, name: str = "looked"):
        from busflow import launch  # not for every test
        from busflow.wire.client.client import Peer

        async with launch(*nodes, inspect=name) as graph:
            peer = await asyncio.to_thread(lambda: Peer(find_run(name)))
            try:
                yield Looked(graph, peer)
            finally:
                await asyncio.to_thread(peer.close)

    return start
