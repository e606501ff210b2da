"""The loop of `busflow run` waits as asyncio's does: for deadlines, for sockets and for other threads."""

import asyncio
import errno
import gc
import os
import selectors
import signal
import socket
import sys
import threading
import time

import pytest

from busflow.runner.loops.system import new_event_loop
from tests.golden import Golden


def run(main):
    with asyncio.Runner(loop_factory=new_event_loop) as runner:
        return runner.run(main())


@pytest.mark.filterwarnings("ignore::ResourceWarning")  # its selector is closed as it goes
def test_loop_without_files_leaves_no_traceback(monkeypatch: pytest.MonkeyPatch, golden: Golden):
    def refuse():
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(socket, "socketpair", refuse)
    with golden.raises(OSError):
        new_event_loop()
    gc.collect()  # pytest fails what raises there


def test_deadlines_come_in_order_and_none_too_early():
    async def main():
        loop = asyncio.get_running_loop()
        start = loop.time()
        fired: list[tuple[str, float]] = []
        done = loop.create_future()
        for name, delay in (("c", 0.003), ("a", 0.0004), ("b", 0.0016)):
            loop.call_later(delay, lambda name=name: fired.append((name, loop.time() - start)))
        loop.call_later(0.004, done.set_result, None)
        await done
        return fired

    fired = run(main)
    assert [name for name, _ in fired] == ["a", "b", "c"]
    assert all(at >= delay for (_, at), delay in zip(fired, (0.0004, 0.0016, 0.003), strict=True))


def test_input_ends_a_wait_that_has_a_deadline():
    async def main():
        here, there = socket.socketpair()
        with here, there:
            here.setblocking(False)
            asyncio.get_running_loop().call_later(0.001, there.send, b"x")
            async with asyncio.timeout(60):
                return await asyncio.get_running_loop().sock_recv(here, 1)

    assert run(main) == b"x"


def test_another_thread_ends_a_wait_with_deadline():
    async def main():
        loop = asyncio.get_running_loop()
        called = loop.create_future()
        thread = threading.Thread(target=lambda: loop.call_soon_threadsafe(called.set_result, "heard"))
        loop.call_later(0.001, thread.start)
        async with asyncio.timeout(60):
            received = await called
        thread.join(60)
        return received

    assert run(main) == "heard"


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no epoll")
def test_each_wake_ends_one_wait():
    from busflow.runner.loops.system import PreciseSelector

    with PreciseSelector() as selector:
        for _ in range(3):
            selector.wake()
            selector.wake()
            assert waits_s(selector, 5) < 5
            assert waits_s(selector, 0.01) >= 0.01


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no epoll")
@pytest.mark.usefixtures("switching")
def test_wake_beside_close_touches_no_other_file():
    from busflow.runner.loops.system import PreciseSelector

    def ring(selector, ended):
        try:
            while not ended.is_set():
                selector._woken = False  # as each wait leaves it, so that each wake writes
                selector.wake()
        except OSError as error:
            failures.append(error)

    failures: list[OSError] = []
    for _ in range(40):
        selector, ended = PreciseSelector(), threading.Event()
        threads = [threading.Thread(target=ring, args=[selector, ended]) for _ in range(2)]
        for thread in threads:
            thread.start()
        selector.close()
        ended.set()
        for thread in threads:
            thread.join(60)
    assert failures == []


@pytest.fixture
def switching():
    """Let threads take turns as often as Python can, which makes a race between two of them likely."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


def waits_s(selector, timeout_s):
    began = time.monotonic()
    assert selector.select(timeout_s) == []
    return time.monotonic() - began


def test_no_wake_of_many_is_lost():
    async def main():
        loop = asyncio.get_running_loop()
        received: list[int] = []

        def call(numbers, done):
            for number in numbers:
                loop.call_soon_threadsafe(received.append, number)
            loop.call_soon_threadsafe(done.set_result, None)

        for numbers in (range(10_000), range(10_000, 10_001)):
            done = loop.create_future()
            thread = threading.Thread(target=call, args=[numbers, done])
            thread.start()
            thread.join(60)  # the loop does nothing meanwhile
            async with asyncio.timeout(60):
                await done
        return received

    assert run(main) == list(range(10_001))


def test_waking_a_closed_loop_raises():
    loop = new_event_loop()
    loop.close()
    with pytest.raises(RuntimeError, match="closed"):
        loop.call_soon_threadsafe(print)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no epoll")
def test_loop_wakes_beyond_the_file_limit_of_select():
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard < 2048:
        pytest.skip("this user may not have so many files open")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 2048), hard))
    opened = [os.open(os.devnull, os.O_RDONLY)]
    try:
        while opened[-1] < 1024:
            opened.append(os.dup(opened[0]))
        test_another_thread_ends_a_wait_with_deadline()
        test_deadlines_come_in_order_and_none_too_early()
    finally:
        for each in opened:
            os.close(each)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@pytest.mark.skipif(not hasattr(signal, "SIGUSR1"), reason="needs POSIX signals")
def test_a_signal_ends_a_wait():
    async def main():
        loop = asyncio.get_running_loop()
        came = loop.create_future()
        loop.add_signal_handler(signal.SIGUSR1, came.set_result, "came")
        loop.call_later(0.001, signal.raise_signal, signal.SIGUSR1)
        async with asyncio.timeout(60):
            return await came

    assert run(main) == "came"


def test_loop_without_epoll_is_asyncio_s_own(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delattr(selectors, "EpollSelector", raising=False)
    loop = new_event_loop()
    try:
        assert loop.run_until_complete(asyncio.sleep(0, "ran")) == "ran"
    finally:
        loop.close()
