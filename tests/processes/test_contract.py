"""Two nodes notice nothing of where they are: every pair is run in one process and in two."""

import json
from collections import defaultdict

import pytest

from busflow.cli import main
from busflow.node.context import Rng
from busflow.recording.bag.bag import Bag

PATIENCE_NS = 60 * 10**9
"""How long a start may take on however slow a machine."""

PAIRS = {
    "order": """
class First(Node):
    numbers = publisher(Int64, "numbers")

    async def run(self) -> None:
        for number in range(300):
            self.numbers.publish(Int64(data=number))


class Second(Node):
    got = ()

    @subscription("numbers", qos=QoS(depth=1000))
    def hear(self, number: Int64) -> None:
        self.got = (*self.got, number.data)
        if len(self.got) == 300:
            self.log.info("holds", what=self.got == tuple(range(300)))
""",
    "latched": """
class First(Node):
    numbers = publisher(Int64, "numbers", qos=QoS(depth=3, durability="transient_local"))

    async def start(self) -> None:
        for number in range(5):
            self.numbers.publish(Int64(data=number))


class Second(Node):
    got = ()

    async def run(self) -> None:
        await self.clock.sleep(0.3)
        late = self.create_subscription(Int64, "numbers", self.hear, qos=QoS(depth=10, durability="transient_local"))

    def hear(self, number: Int64) -> None:
        self.got = (*self.got, number.data)
        if number.data == 4:
            self.log.info("holds", what=self.got == (2, 3, 4))
""",
    "service": """
class First(Node):
    @service(SetBool, "switch")
    async def switch(self, request: SetBool.Request) -> SetBool.Response:
        if not request.data:
            raise ValueError("it stays on")
        return SetBool.Response(success=True, message="on")


class Second(Node):
    switch = client(SetBool, "switch")

    async def start(self) -> None:
        answer = await self.switch.call(SetBool.Request(data=True))
        try:
            await self.switch.call(SetBool.Request(data=False))
        except ServiceFailed as error:
            self.log.info("holds", what=answer.message == "on" and "it stays on" in str(error))
""",
    "both_ways": """
class First(Node):
    there = publisher(Int64, "there")
    beat = timer(0.01)

    async def run(self) -> None:
        self.there.publish(Int64(data=0))

    @subscription("back")
    def hear(self, number: Int64) -> None:
        self.there.publish(Int64(data=number.data + 1))


class Second(Node):
    back = publisher(Int64, "back")

    @subscription("there")
    def hear(self, number: Int64) -> None:
        if number.data == 200:
            self.log.info("holds", what=True)
        else:
            self.back.publish(number)
""".replace("    beat = timer(0.01)\n", ""),
    "deadline": """
class First(Node):
    numbers = publisher(Int64, "numbers", qos=QoS(deadline=0.1))

    async def run(self) -> None:
        self.numbers.publish(Int64(data=0))


class Second(Node):
    @subscription("numbers", qos=QoS(deadline=0.2))
    def hear(self, number: Int64) -> None:
        pass

    @on_event("numbers")
    def missed(self, event: DeadlineMissed) -> None:
        self.log.info("holds", what=True)
""",
    "matched": """
class First(Node):
    numbers = publisher(Int64, "numbers")
    matched = 0

    @on_event("numbers")
    def on_matched(self, event: PublisherMatched) -> None:
        self.numbers.publish(Int64(data=event.current))


class Second(Node):
    @on_event("numbers")
    def on_matched(self, event: SubscriptionMatched) -> None:
        self.log.info("holds", what=event.current == 1)

    @subscription("numbers")
    def hear(self, number: Int64) -> None:
        pass
""",
    "lease": """
class First(Node):
    numbers = publisher(Int64, "numbers", qos=QoS(liveliness="manual_by_topic", lease=0.2))

    async def run(self) -> None:
        self.numbers.publish(Int64(data=1))


class Second(Node):
    alive = False

    @subscription("numbers", qos=QoS(liveliness="manual_by_topic", lease=0.5))
    def hear(self, number: Int64) -> None:
        self.alive = True

    @on_event("numbers")
    def changed(self, event: LivelinessChanged) -> None:
        if self.alive and not event.alive:
            self.log.info("holds", what=True)
""",
    "expired": """
class First(Node):
    numbers = publisher(Int64, "numbers", qos=QoS(depth=3, durability="transient_local", lifespan=0.1))

    async def start(self) -> None:
        self.numbers.publish(Int64(data=1))

    async def run(self) -> None:
        await self.clock.sleep(1.0)
        while True:
            self.numbers.publish(Int64(data=2))
            await self.clock.sleep(0.1)


class Second(Node):
    async def run(self) -> None:
        await self.clock.sleep(0.5)
        self.create_subscription(Int64, "numbers", self.hear, qos=QoS(durability="transient_local"))

    def hear(self, number: Int64) -> None:
        self.log.info("holds", what=number.data == 2)
""",
    "latched_the_other_way": """
class First(Node):
    async def run(self) -> None:
        await self.clock.sleep(0.3)
        self.create_subscription(Int64, "numbers", self.hear, qos=QoS(depth=2, durability="transient_local"))

    def hear(self, number: Int64) -> None:
        self.log.info("holds", what=number.data == self.expected)
        self.expected += 1

    expected = 3


class Second(Node):
    numbers = publisher(Int64, "numbers", qos=QoS(depth=10, durability="transient_local"))

    async def start(self) -> None:
        for number in range(5):
            self.numbers.publish(Int64(data=number))
""",
    "every_way_in_which_a_call_fails": """
class First(Node):
    async def start(self) -> None:
        self.gone, self.to_go = asyncio.Event(), asyncio.Event()

    @service(SetBool, "fails")
    def fail(self, request: SetBool.Request) -> SetBool.Response:
        raise ValueError("it stays on")

    @service(Trigger, "never")
    async def never(self, request: Trigger.Request) -> Trigger.Response:
        await asyncio.Event().wait()

    @service(Trigger, "goes", depth=1)
    async def go(self, request: Trigger.Request) -> Trigger.Response:
        self.gone.set()
        await asyncio.Event().wait()

    @service(Trigger, "has_gone")
    async def has_gone(self, request: Trigger.Request) -> Trigger.Response:
        await self.gone.wait()
        return Trigger.Response(success=True)

    @subscription("leave")
    def leave(self, number: Int64) -> None:
        self.to_go.set()

    async def run(self) -> None:
        await self.to_go.wait()
        raise RuntimeError("gone")


class Second(Node):
    fails, never, goes = client(SetBool, "fails"), client(Trigger, "never"), client(Trigger, "goes")
    has_gone, nobody = client(Trigger, "has_gone"), client(Trigger, "nobody")
    leave = publisher(Int64, "leave")

    async def run(self) -> None:
        found = [
            await self.error_of(self.nobody.call()),
            await self.error_of(self.fails.call()),
            await self.error_of(self.never.call(timeout=0.2)),
        ]
        waiting = [asyncio.ensure_future(self.error_of(self.goes.call()))]
        await self.has_gone.call()
        waiting.append(asyncio.ensure_future(self.error_of(self.goes.call())))
        await asyncio.sleep(0)
        found.append(await self.error_of(self.goes.call()))
        self.leave.publish(Int64(data=0))
        found += [await each for each in waiting]
        self.log.info("told", found=found)
        expected = ["ServiceUnavailable", "ServiceFailed", "ServiceTimeout", "ServiceUnavailable"]
        self.log.info("holds", what=found == [*expected, "ServiceGone", "ServiceGone"])

    async def error_of(self, call):
        try:
            return await call
        except ServiceError as error:
            return type(error).__name__
""",
}
IMPORTS = """
import asyncio

from pydantic import Field

from busflow import *
from busflow.msgs.std_msgs import Float64, Int64, String
from busflow.msgs.std_srvs import SetBool, Trigger

"""


TUNED = """
from busflow.msgs.rcl_interfaces import ParameterEvent


class FirstParameters(Parameters):
    gain: float = Field(default=1.0, ge=0)
    label: str = "a"


class First(Node):
    parameters: FirstParameters
    gains = publisher(Float64, "gains")

    @on_parameters
    def changed(self, old: FirstParameters) -> None:
        self.gains.publish(Float64(data=old.gain + self.parameters.gain))


class Second(Node):
    @subscription("/parameter_events")
    def on_change(self, event: ParameterEvent) -> None:
        for each in event.changed_parameters:
            self.log.info("heard of", what=f"{event.node} {each.name} {each.value.double_value}")

    @subscription("gains")
    def on_gain(self, gain: Float64) -> None:
        self.log.info("follows", sum=gain.data)

    async def run(self) -> None:
        self.log.info("ready")
"""


SEEN = """
class First(Node):
    numbers = publisher(Int64, "numbers")

    async def start(self) -> None:
        self.log.info("draws", drawn=int(self.rng.integers(1 << 40)), at=self.clock.now().nanoseconds)

    async def run(self) -> None:
        for number in range(100):
            self.numbers.publish(Int64(data=number))


class Second(Node):
    got = 0

    async def start(self) -> None:
        self.log.info("draws", drawn=int(self.rng.integers(1 << 40)), at=self.clock.now().nanoseconds)

    @subscription("numbers", qos=QoS(depth=1000))
    def hear(self, number: Int64) -> None:
        self.got += 1
        if self.got == 100:
            self.log.info("has all")
"""


def process_of(name, apart):
    """Where a node of a pair runs: the first, if apart, in a process of its own."""
    return f", restart: on-failure{', process: other' if apart else ''}" if name == "First" else ""


@pytest.fixture(scope="module", params=[False, True], ids=["together", "apart"])
def run(start_for_all, request):
    """All pairs at once, each in a namespace of its own: a run of two processes takes long to start."""
    sources = {**PAIRS, "tuned": TUNED, "seen": SEEN}
    nodes = [
        f"  {pair}_{name}: {{plugin: 'pair_{pair}:{name}', namespace: {pair}{process_of(name, request.param)}}}\n"
        for pair in sources
        for name in ("Second", "First")
    ]
    files = {f"plugins/pair_{pair}.py": f"{IMPORTS}{source}" for pair, source in sources.items()}
    run = start_for_all(f"processes: {{other: {{}}}}\nnodes:\n{''.join(nodes)}", "--seed", "7", files=files)
    yield run
    assert run.end() == 130


@pytest.fixture
def command(run, monkeypatch, capsys):
    """Runs a command that looks into the run, and returns its exit code and what it prints."""
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))

    def answer(*words):
        return main(words), "".join(capsys.readouterr())

    return answer


def test_pairs_behave_alike_wherever_they_run(run):
    for pair in PAIRS:
        run.wait_for('"event": "holds"', f'"node": "/{pair}/')
        run.wait_for('"event": "holds"', f'"node": "/{pair}/', '"what": true')


def test_parameters_are_set_read_and_announced(run, command):
    run.wait_for("ready", '"node": "/tuned/')
    code, printed = command("param", "set", "/tuned/tuned_First", "gain", "-1")
    assert code == 1
    assert "gain must be at least 0" in printed
    assert command("param", "set", "/tuned/tuned_First", "gain", "2.5", "label", "b")[0] == 0
    run.wait_for("heard of", "/tuned/tuned_First gain 2.5")
    run.wait_for("follows", "3.5")
    assert command("param", "get", "/tuned/tuned_First", "gain") == (0, "Double value is: 2.5\n")
    get = ["/tuned/tuned_First/get_parameters", "rcl_interfaces/srv/GetParameters", "{names: [gain, label]}"]
    code, printed = command("service", "call", *get)
    assert code == 0
    assert "double_value=2.5" in printed
    assert "string_value='b'" in printed


def test_clock_seed_and_statistics_agree(run, command):
    run.wait_for("has all")
    draws = {each["node"]: each["drawn"] for each in run.log() if each["event"] == "draws"}
    nodes = ("/seen/seen_First", "/seen/seen_Second")
    assert draws == {name: int(Rng(7, name).integers(1 << 40)) for name in nodes}
    moments = [each["at"] for each in run.log() if each["event"] == "draws"]
    assert max(moments) - min(moments) < PATIENCE_NS, "both go by the time of the machine"
    code, printed = command("topic", "stats", "/seen/numbers", "--json")
    assert code == 0
    (topic,) = json.loads(printed)["topics"]
    assert topic["published"] == 100
    (line,) = topic["subscriptions"]
    assert (line["node"], line["published"], line["delivered"], line["dropped"]) == (nodes[1], 100, 100, 0)


KEPT = """
class First(Node):
    numbers, words = publisher(Int64, "numbers"), publisher(String, "words", qos=QoS(durability="transient_local"))

    async def start(self) -> None:
        self.words.publish(String(data="begun"))

    async def run(self) -> None:
        for number in range(100):
            self.numbers.publish(Int64(data=number))

    @service(SetBool, "switch")
    async def switch(self, request: SetBool.Request) -> SetBool.Response:
        return SetBool.Response(success=request.data, message="on")


class Second(Node):
    sums = publisher(Int64, "sums")
    switch = client(SetBool, "switch")
    sum = 0

    async def start(self) -> None:
        await self.switch.call(SetBool.Request(data=True))

    @subscription("numbers", qos=QoS(depth=1000))
    def hear(self, number: Int64) -> None:
        self.sum += number.data
        self.sums.publish(Int64(data=self.sum))
        if number.data == 99:
            self.log.info("has all")
"""


def recorded(start, apart):
    """By topic, what a run of the two has recorded, in order."""
    name = "apart" if apart else "together.mcap"
    nodes = "".join(
        f"  {each.lower()}: {{plugin: 'pair:{each}'{process_of(each, apart)}}}\n" for each in ("Second", "First")
    )
    text = f"processes: {{other: {{}}}}\nnodes:\n{nodes}"
    run = start(text, "--record", name, files={"plugins/pair.py": f"{IMPORTS}{KEPT}"})
    run.wait_for("has all")
    assert run.end() == 130
    found = defaultdict(list)
    with Bag(run.folder / name) as bag:
        assert bag.complete, bag.incomplete
        for entry in bag.entries():
            found[entry.channel.topic].append(entry.payload)
    return found


@pytest.mark.long
def test_a_recording_holds_the_same(start):
    together, apart = recorded(start, apart=False), recorded(start, apart=True)
    assert together.keys() == apart.keys()
    for topic, count in (("/numbers", 100), ("/sums", 100), ("/words", 1)):
        assert len(together[topic]) == count
        assert together[topic] == apart[topic]
    calls = "/switch/_service_event"
    assert len(together[calls]) == len(apart[calls]) > 0
