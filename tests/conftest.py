"""What several test files need: ends of topics that belong to no node, on virtual time."""

import asyncio
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from busflow.bus.bus import Bus
from busflow.bus.endpoint import Endpoint
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.bus.subscription import Subscription
from busflow.clock import SimClock
from busflow.msgs.std_msgs import Int64

# How long an example takes, or is drawn, says how busy the machine is.
ON_ANY_MACHINE = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("seeded", ON_ANY_MACHINE, derandomize=True)
"""The same examples each time: whether a change passes does not depend on luck."""
settings.register_profile("random", ON_ANY_MACHINE, max_examples=500)
"""Other and more examples each time: `pytest --hypothesis-profile=random`."""
settings.load_profile("seeded")

# A shell that starts the tests in the background has them ignore Ctrl-C, and with them whatever they start.
signal.signal(signal.SIGINT, signal.default_int_handler)


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
    if not config.option.markexpr and not any("::" in argument for argument in config.args):
        config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker("long")])
        items[:] = [item for item in items if not item.get_closest_marker("long")]
    slow = {item.path for item in items if item.get_closest_marker("timeout")}
    items.sort(key=lambda item: item.path not in slow)


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


@pytest.fixture(scope="session", autouse=True)
def runtime_folder() -> Iterator[Path]:
    """Where the runs of these tests are found, and no others; its path is short enough for a socket."""
    folder = Path(tempfile.mkdtemp(prefix="bf", dir="/tmp"))  # the default is too long for a socket on macOS
    os.environ["BUSFLOW_RUNTIME_DIR"] = str(folder)
    yield folder
    del os.environ["BUSFLOW_RUNTIME_DIR"]
    shutil.rmtree(folder, ignore_errors=True)
