"""What a run of several processes survives: signals, slow readers, large messages, late starts, doubles."""

import os
import select
import signal
from pathlib import Path

import pytest

from busflow.wire.client.runs import ask_runs

PATIENCE_S = 60.0

TELLING = """
import os

from busflow import Node, subscription, on_event, SubscriptionMatched
from busflow.msgs.std_msgs import Int64


class Telling(Node):
    told = False

    @subscription("numbers")
    def hear(self, number: Int64) -> None:
        pass

    @on_event("numbers")
    def on_matched(self, event: SubscriptionMatched) -> None:
        if event.current_change < 0 and not self.told:  # the log goes through the main process, which stands still now
            self.told = True
            self.spawn(self.tell())

    async def tell(self) -> None:
        await self.clock.sleep(4.0)  # by then nobody tries to reach it every second any more
        with open("gone", "w") as pipe:
            pipe.write("gone")
"""
FROM_MAIN = """
processes:
  left: {restart: always}
  right: {restart: always}
nodes:
  teller: {plugin: teller, parameters: {rate_hz: 100.0}}
  telling: {plugin: telling, process: left}
  hearer: {plugin: hearer, process: right, parameters: {tell_at: 20}}
  later: {plugin: hearer, process: right, parameters: {tell_at: 500}}
"""


@pytest.mark.long
def test_continued_main_process_does_not_kill_workers(start):
    run = start(FROM_MAIN, "-v", files={"plugins/telling.py": TELLING})
    os.mkfifo(run.folder / "gone")
    pipe = os.open(run.folder / "gone", os.O_RDONLY | os.O_NONBLOCK)
    run.wait_for("heard enough")
    run.process.send_signal(signal.SIGSTOP)
    try:
        ready, _, _ = select.select([pipe], [], [], PATIENCE_S)
        assert ready, "the others see that it does not answer"
    finally:
        run.process.send_signal(signal.SIGCONT)
        os.close(pipe)
    run.wait_for("heard enough", times=2)
    assert run.end() == 130
    assert not [line for line in run.lines if "hangs" in line or "restarts in" in line]
    assert [each["restarts"] for each in run.report()["processes"]] == [0, 0, 0]


@pytest.mark.long
def test_last_process_ends_after_the_others_die(start, have_ended):
    run = start(FROM_MAIN.replace("plugin: telling", "plugin: hearer"), "-v")
    run.wait_for("heard enough")
    pids = run.pids()
    os.kill(pids["left"], signal.SIGKILL)
    run.process.send_signal(signal.SIGKILL)
    assert run.end(None) == -9
    assert have_ended([*pids.values()], PATIENCE_S)


@pytest.mark.long
def test_main_process_restarts_all_dead_workers(start):
    run = start(FROM_MAIN.replace("plugin: telling", "plugin: hearer"), "-v")
    run.wait_for("heard enough", times=2)
    each_process_is_a_new_interpreter_and_no_fork(run)
    for process in ("left", "right"):
        run.kill(process)
    run.wait_for("heard enough", times=4)
    assert run.end() == 130
    assert [each["restarts"] for each in run.report()["processes"]] == [0, 1, 1]


@pytest.mark.long
def test_stopped_process_is_killed_at_the_end(start, have_ended):
    run = start(FROM_MAIN.replace("plugin: telling", "plugin: hearer"), "-v", grace="750ms")
    run.wait_for("heard enough", times=2)
    pids = [*run.pids().values()]
    run.kill("left", signal.SIGSTOP)
    assert run.end() == 130
    assert have_ended(pids, 0)
    fate = "the process left was ended by SIGKILL, since it did not stop in time"
    assert [each["level"] for each in run.log() if each["event"] == fate] == ["error"]
    assert f"error: {fate}\n" in run.lines
    (left,) = [each for each in run.report()["processes"] if each["name"] == "left"]
    assert (left["state"], left["fates"]) == ("failed", [fate])


STUCK = """
import threading

from busflow import Node


class Stuck(Node):
    async def stop(self) -> None:
        threading.Event().wait()
"""


@pytest.mark.long
def test_process_ended_by_force_fails_the_run(start):
    run = start(
        "processes: {far: }\nnodes: {stuck: {plugin: stuck, process: far}}\n",
        "--for",
        "0.2s",
        files={"plugins/stuck.py": STUCK},
        grace="750ms",
    )
    assert run.end(None) == 1
    (far,) = [each for each in run.report()["processes"] if each["name"] == "far"]
    assert (run.report()["exit_code"], far["state"], len(far["fates"])) == (1, "failed", 1)
    (fate,) = far["fates"]
    assert fate == "the process far did not stop in time, and had to end itself"
    assert [each["level"] for each in run.log() if each["event"] == fate] == ["error"]
    assert any("did not end within" in line and "stuck.py" in line for line in run.lines)


PACED = """
import asyncio
import threading

import numpy as np

from busflow import Node, Parameters, QoS, publisher, subscription, timer
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Int64


class SourceParameters(Parameters):
    bytes: int = 100_000
    image_hz: float = 100.0
    number_hz: float = 200.0
    most: int = 600


class Source(Node):
    parameters: SourceParameters
    images = publisher(Image, "images")
    numbers = publisher(Int64, "numbers")
    told = 0

    async def start(self) -> None:
        size = self.parameters.bytes
        self.image = Image(width=size, height=1, encoding="mono8", step=size, data=np.zeros(size, np.uint8))

    @timer(hz="image_hz")
    def show(self) -> None:
        self.images.publish(self.image)

    @timer(hz="number_hz", missed="burst")
    def tell(self) -> None:
        if self.told < self.parameters.most:
            self.told += 1
            self.numbers.publish(Int64(data=self.told))


class Counter(Node):
    heard = 0

    @subscription("numbers", qos=QoS(depth=4096))
    def hear(self, number: Int64) -> None:
        self.heard += 1
        if number.data != self.heard:
            self.log.error("missing", heard=self.heard, number=number.data)
            self.heard = number.data
        if number.data % 600 == 0:
            self.log.info("counted", number=number.data)


class Stuck(Node):
    @subscription("images")
    async def see(self, image: Image) -> None:
        self.log.info("is stuck")
        await asyncio.Event().wait()


class Slow(Node):
    @subscription("images")
    def see(self, image: Image) -> None:
        self.log.info("is slow")
        threading.Event().wait(0.2)


class Viewer(Node):
    seen = 0

    @subscription("images")
    def see(self, image: Image) -> None:
        self.seen += 1
        if self.seen == 20:
            self.log.info("seen enough", bytes=len(image.data))
"""


def paced(text):
    return {"files": {"plugins/paced.py": PACED}, "text": text}


def numbers_are_all_there(run):
    assert run.end() == 130
    topic = run.topic("/numbers")
    assert topic["losses"] == {}
    assert {(line["published"], line["dropped"]) for line in topic["subscriptions"]} == {(topic["published"], 0)}
    assert not [line for line in run.lines if "missing" in line]
    for each in run.report()["topics"]:
        for line in each["subscriptions"]:
            assert line["published"] == line["delivered"] + line["dropped"] + line["queued"]


@pytest.mark.long
def test_stuck_remote_subscriber_stalls_no_other_topic(start):
    run = start(
        **paced("""
processes: {far: }
nodes:
  source: {plugin: "paced:Source"}
  stuck: {plugin: "paced:Stuck", process: far}
  counter: {plugin: "paced:Counter", process: far}
""")
    )
    run.wait_for("is stuck")
    run.wait_for("counted")
    numbers_are_all_there(run)
    (line,) = run.topic("/images")["subscriptions"]
    assert line["delivered"] == 1
    assert line["dropped"] > 0


@pytest.mark.long
def test_slow_process_delays_no_other_process(start):
    run = start(
        **paced("""
processes: {far: , slow: }
nodes:
  source: {plugin: "paced:Source", process: far}
  slow: {plugin: "paced:Slow", process: slow}
  counter: {plugin: "paced:Counter"}
""")
    )
    run.wait_for("is slow")
    run.wait_for("counted")
    numbers_are_all_there(run)


@pytest.mark.long
def test_large_messages_do_not_delay_small_ones(start):
    run = start(
        **paced("""
processes: {far: }
nodes:
  source:
    plugin: "paced:Source"
    process: far
    parameters: {bytes: 6000000, image_hz: 20.0, number_hz: 1000.0, most: 3000}
  viewer: {plugin: "paced:Viewer"}
  counter: {plugin: "paced:Counter"}
""")
    )
    run.wait_for('"number": 3000')
    run.wait_for("seen enough", '"bytes": 6000000')
    numbers_are_all_there(run)


@pytest.mark.parametrize("late", ["left", "right"])
@pytest.mark.long
def test_processes_may_start_in_any_order_and_late(start, late):
    slow = "import os, threading\nif os.environ.get('LATE'):\n    threading.Event().wait(2)\n"
    run = start(
        f"""
processes:
  left: {{env: {{LATE: "{"1" if late == "left" else ""}"}}}}
  right: {{env: {{LATE: "{"1" if late == "right" else ""}"}}}}
nodes:
  teller: {{plugin: teller, process: left, parameters: {{at_start: 500}}}}
  slow: {{plugin: slow, process: {late}}}
  hearer: {{plugin: hearer, process: right, parameters: {{tell_at: 500}}, subscriptions: {{numbers: {{depth: 1000}}}}}}
""",
        files={"plugins/slow.py": f"{slow}from busflow import Node\n\n\nclass Slow(Node):\n    pass\n"},
    )
    run.wait_for("heard enough")
    assert run.end() == 130
    topic = run.topic("/numbers")
    assert (topic["published"], topic["losses"]) == (500, {})


@pytest.mark.long
def test_two_runs_of_one_name_stay_apart(start, monkeypatch):
    text = FROM_MAIN.replace("plugin: telling", "plugin: hearer")
    first, second = start(text, "--run", "twin"), start(text, "--run", "twin", "--report", "second.json")
    for run in (first, second):
        run.wait_for("heard enough", times=2)
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(first.runtime))
    present = [*ask_runs(PATIENCE_S)]
    assert len({each.run.name for each in present}) == 2
    assert {each.run.card.pid for each in present} == {first.process.pid, second.process.pid}
    for run in (second, first):
        assert run.end() == 130
        assert not [line for line in run.lines if "begins anew" in line], "numbers of two tellers would go back"


def each_process_is_a_new_interpreter_and_no_fork(run):
    for process, pid in run.pids().items():
        command = Path(f"/proc/{pid}/cmdline").read_text().split("\0")
        assert command[command.index("--process") + 1] == process
        assert Path(f"/proc/{pid}/exe").samefile(f"/proc/{run.process.pid}/exe")
        assert os.getpgid(pid) == pid


HANGING = """
import threading
import time

from busflow import Node, Parameters, timer


class HangingParameters(Parameters):
    spins: bool = True


class Hanging(Node):
    parameters: HangingParameters

    async def start(self) -> None:
        time.sleep(1.5)  # longer than `hang`

    @timer(0.3)
    def hang(self) -> None:
        while self.parameters.spins:
            pass
        threading.Event().wait()
"""


@pytest.mark.long
@pytest.mark.parametrize("spins", [True, False])
def test_a_handler_that_hangs_is_restarted(start, spins):
    run = start(
        "processes: {far: {restart: on-failure, hang: 1s}}\n"
        f"nodes: {{hanging: {{plugin: hanging, process: far, parameters: {{spins: {str(spins).lower()}}}}}}}\n",
        files={"plugins/hanging.py": HANGING},
    )
    run.wait_for("hangs: its event loop stands still", times=2)
    run.end()
    (far,) = [each for each in run.report()["processes"] if each["name"] == "far"]
    assert far["restarts"] >= 1
    assert far["fates"][0] == "the process far was ended by SIGKILL, since it hung"
