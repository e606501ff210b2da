"""Nodes that are interrupted while they do what is hard to end; each logs `ticking` first."""

import asyncio
import ctypes
import signal
import threading
import time

from busflow import Node, timer


class Polite(Node):
    """Closes its device."""

    @timer(0.01)
    def tick(self) -> None:
        self.log.info("ticking")

    async def stop(self) -> None:
        self.log.info("closed the device")


class Busy(Node):
    """Never returns from a timer."""

    @timer(0.01)
    def tick(self) -> None:
        self.log.info("ticking")
        while True:
            pass


class Asleep(Node):
    """Sleeps for an hour, and the event loop with it."""

    @timer(0.01)
    def tick(self) -> None:
        self.log.info("ticking")
        time.sleep(3600)


class Deaf(Node):
    """Waits for ever in C, which no signal ends."""

    @timer(0.01)
    def tick(self) -> None:
        threading.Timer(0.1, self.log.info, ["ticking"]).start()
        libc, lock = ctypes.CDLL(None), ctypes.create_string_buffer(128)
        libc.pthread_mutex_init(lock, None)
        libc.pthread_mutex_lock(lock)
        libc.pthread_mutex_lock(lock)


class SlowToStop(Node):
    """Takes an hour to stop."""

    @timer(0.01)
    def tick(self) -> None:
        self.log.info("ticking")

    async def stop(self) -> None:
        await asyncio.sleep(0.2)  # longer than one signal may be sent twice
        self.log.info("stopping")
        await asyncio.sleep(3600)


class Thread(Node):
    """Waits for a thread of busflow's."""

    async def run(self) -> None:
        self.log.info("ticking")
        await self.run_sync(time.sleep, 3600)


class Pool(Node):
    """Waits for a thread of asyncio's."""

    async def run(self) -> None:
        self.log.info("ticking")
        await asyncio.to_thread(time.sleep, 3600)


class Starting(Node):
    """Never ends its start."""

    async def start(self) -> None:
        self.log.info("ticking")
        await asyncio.Event().wait()


class OwnSignal(Node):
    """Handles a signal itself."""

    async def start(self) -> None:
        asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, self.on_signal)
        self.log.info("ticking")

    def on_signal(self) -> None:
        self.log.info("got the signal")
