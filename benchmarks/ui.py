"""What `busflow ui` costs: 50 topics at 100 Hz, of which a page plots 10; the server's share of a core, and the run's.

Then the run is killed, and the time is printed until the page knows it.

    python benchmarks/ui.py [--seconds 10]

The page is a WebSocket client that subscribes and follows as the one in a browser does. Linux: it reads /proc.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter

from websockets.sync.client import connect

TOPICS, RATE_HZ, PLOTS = 50, 100, 10
TICK_S = 1 / os.sysconf("SC_CLK_TCK")
NODE = f'''
"""Topics with a number each."""

from busflow import Node, Parameters
from busflow.msgs.std_msgs import Float64


class Many(Node):
    """Publishes a number on every topic."""

    def declare(self) -> None:
        self.all = [self.create_publisher(Float64, f"number_{{each:02}}") for each in range({TOPICS})]
        self.create_timer(hz={RATE_HZ}, handler=self.tick)

    def tick(self) -> None:
        for each in self.all:
            each.publish(Float64(data=self.clock.seconds()))
'''


@contextmanager
def started(folder: Path, *command: str) -> Iterator[subprocess.Popen[str]]:
    """A command of busflow that goes on while the block lasts."""
    environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": str(folder / "runs"), "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(  # noqa: S603  # a command of ours
        [sys.executable, "-m", "busflow", *command],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)


def cpu_s(process: subprocess.Popen[str]) -> float:
    """Processor time that a process has used so far."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) * TICK_S


def shares(processes: list[subprocess.Popen[str]], seconds: float, receive: object = None) -> tuple[list[float], int]:
    """The share of a core that each process uses for a time, in percent, and the messages received meanwhile."""
    before, begun, count = [cpu_s(each) for each in processes], perf_counter(), 0
    while (passed := perf_counter() - begun) < seconds:
        if receive is None:
            signal.sigtimedwait([], min(0.2, seconds - passed))
        else:
            count += receive()  # type: ignore[operator]  # a function, where there is one
    took = perf_counter() - begun
    return [100 * (cpu_s(each) - was) / took for each, was in zip(processes, before, strict=True)], count


def measure(seconds: float) -> None:
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as path:
        folder = Path(path)
        (folder / "lab").mkdir()
        (folder / "runs").mkdir(mode=0o700)
        (folder / "lab/many.py").write_text(NODE)
        (folder / "many.yaml").write_text("name: many\nplugins: [lab]\nnodes:\n  many:\n    plugin: many\n")
        with started(folder, "run", "many.yaml", "--watchdog", "off") as run:
            wait_for(folder)
            (alone,), _ = shares([run], seconds)
            with started(folder, "ui", "--port", "0") as ui:
                found = re.search(r"http://(\S+?)/#token=(\S+)", ui.stdout.readline() if ui.stdout else "")
                if found is None:
                    sys.exit("busflow ui does not start: is the page built?")
                (idle_run, idle), _ = shares([run, ui], seconds)
                with connect(f"ws://{found[1]}/ws", subprotocols=["foxglove.sdk.v1"], max_size=None) as page:  # type: ignore[list-item]  # text will do
                    look(page, found[2])

                    def receive() -> int:
                        message = page.recv(timeout=10)
                        return isinstance(message, bytes) and message[0] == 1

                    shares([run], 1.0, receive)
                    (run_share, ui_share), count = shares([run, ui], seconds, receive)
                    end_s = time_until_end(run, page)
        print(f"{TOPICS} topics at {RATE_HZ} Hz, {PLOTS} plots, over {seconds:g} s each, shares of one core:")
        print(f"  the run alone             {alone:6.1f} %")
        print(f"  the run, the server idle  {idle_run:6.1f} %   the server {idle:6.1f} %")
        print(f"  the run, a page plots     {run_share:6.1f} %   the server {ui_share:6.1f} %   (aim: at most 15 %)")
        print(f"  messages to the page      {count / seconds:6.0f} /s of {PLOTS * RATE_HZ}")
        print(f"  the end of a killed run reaches the page after {end_s * 1000:.0f} ms (aim: 1000 ms)")


def time_until_end(run: subprocess.Popen[str], page: object) -> float:
    """Kill a run, and return the time until the page receives that it has ended."""
    begun = perf_counter()
    run.kill()
    while True:
        message = page.recv(timeout=10)  # type: ignore[attr-defined]  # a connection
        if isinstance(message, str) and '"ended"' in message:
            return perf_counter() - begun


def wait_for(folder: Path) -> None:
    """Wait until the run is found."""
    for _ in range(100):
        environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": str(folder / "runs")}
        command = [sys.executable, "-m", "busflow", "topic", "list"]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)  # noqa: S603  # as above
        if "number_00" in done.stdout:
            return
    sys.exit("the run does not start")


def look(page: object, token: str) -> None:
    """Let a page in, and subscribe to what it plots."""

    def send(op: str, **fields: object) -> None:
        page.send(json.dumps({"op": op, **fields}))  # type: ignore[attr-defined]  # a connection

    send("busflow/hello", token=token)
    for question in ("graph", "log", "health", "run"):
        send("busflow/follow", question=question, on=True)
    while True:
        message = page.recv(timeout=10)  # type: ignore[attr-defined]  # as above
        if isinstance(message, str) and json.loads(message)["op"] == "advertise":
            channels = [each["id"] for each in json.loads(message)["channels"] if "number" in each["topic"]][:PLOTS]
            send("subscribe", subscriptions=[{"id": id_, "channelId": id_} for id_ in channels])
            return


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    measure(parser.parse_args().seconds)
