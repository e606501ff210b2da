"""A node's parameters while it runs: what each is, where its value came from, and how it is set."""

import math

import pytest
from pydantic import Field

from busflow import Node, Parameters, on_parameters, timer
from busflow.errors import InvalidParameter, NotRunning
from busflow.launchfile.load.load import load
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.node.node import runtime_of
from busflow.node.parameters import ReadOnly
from busflow.testing import harness, virtual_time


class Noise(Parameters):
    imu: float = Field(default=0.1, ge=0, le=10, description="Half width.")
    joints: float = 0.0


class SensorParameters(Parameters):
    rate_hz: float = Field(default=10.0, ge=0, le=1000, description="How often.")
    noise: Noise = Noise()
    frame: ReadOnly[str] = "imu_link"
    spare: Noise | None = None


class Sensor(Node):
    parameters: SensorParameters


def store_of(node):
    return runtime_of(node).parameters


def test_every_parameter_is_described_with_its_value():
    rows = store_of(Sensor(noise={"imu": 0.5})).describe()
    assert [(row.name, row.value) for row in rows] == [
        ("rate_hz", 10.0),
        ("noise.imu", 0.5),
        ("noise.joints", 0.0),
        ("frame", "imu_link"),
        ("spare.imu", None),
        ("spare.joints", None),
    ]
    imu = rows[1].info
    assert (imu.type, imu.default, str(imu.bounds), imu.description) == (
        "float",
        0.1,
        "at least 0, at most 10",
        "Half width.",
    )
    assert rows[3].info.read_only


def test_a_value_comes_from_code_or_default():
    rows = store_of(Sensor(SensorParameters(noise=Noise(imu=0.5)))).describe()
    assert [str(row.source) for row in rows] == ["default", "code", *["default"] * 4]


def test_an_unknown_parameter_suggests_the_nearest_name(golden):
    with golden.raises(InvalidParameter):
        store_of(Sensor()).get("noise.imo")


@virtual_time
async def test_a_launch_file_value_has_its_place(tmp_path):
    (tmp_path / "sensor.py").write_text(
        "from busflow import Node, Parameters\n"
        "class Noise(Parameters):\n    imu: float = 0.1\n    joints: float = 0.0\n"
        "class SensorParameters(Parameters):\n    rate_hz: float = 1.0\n    gain: float = 1.0\n"
        "    noise: Noise = Noise()\n"
        "class Sensor(Node):\n    parameters: SensorParameters\n"
    )
    file = tmp_path / "lab.yaml"
    file.write_text(
        "args:\n  rate:\n    type: float\n    default: 5.0\nplugins: [.]\nnodes:\n  sensor:\n    plugin: sensor\n"
        "    parameters:\n      rate_hz: ${args.rate}\n      noise:\n        imu: 0.5\n"
    )
    async with harness(file) as lab:
        rows = {row.name: row for row in store_of(lab.node("sensor")).describe()}
    assert rows["noise.imu"].source.place.line == 12
    assert str(rows["noise.imu"].source).endswith("lab.yaml:12:14")
    assert str(rows["rate_hz"].source).endswith("lab.yaml:4:14")
    assert [str(rows[name].source) for name in ("gain", "noise.joints")] == ["default", "default"]
    given = load(file, assignments=["rate:=7"], sets=["nodes.sensor.parameters.gain=2"])
    async with harness(given) as lab:
        rows = {row.name: row for row in store_of(lab.node("sensor")).describe()}
    assert (rows["gain"].value, str(rows["gain"].source), rows["gain"].source.place) == (2.0, "command line", None)
    assert (rows["rate_hz"].value, rows["rate_hz"].source.place.line) == (7.0, 10)
    assert str(rows["rate_hz"].source).endswith("lab.yaml:10:16, from command line")


# Setting.


class Recorder(Node):
    """Ticks at a parameter's rate and remembers what it was told."""

    parameters: SensorParameters

    async def start(self) -> None:
        self.ticks: list[float] = []
        self.told: list[tuple[float, float]] = []

    @timer(hz="rate_hz")
    def tick(self) -> None:
        self.ticks.append(round(self.clock.seconds(), 3))

    @timer(0.25)
    def steady(self) -> None: ...

    @on_parameters
    def retune(self, old: SensorParameters) -> None:
        self.told.append((old.noise.imu, self.parameters.noise.imu))


@virtual_time
async def test_set_replaces_the_object_and_returns_the_changes():
    async with harness(Recorder) as lab:
        node = lab.node(Recorder)
        before = node.parameters
        assert lab.set_parameters(Recorder, {"noise.imu": 0.5, "rate_hz": 20}) == ("rate_hz", "noise.imu")
        assert node.parameters == SensorParameters(rate_hz=20, noise=Noise(imu=0.5))
        assert before == SensorParameters()
        assert node.told == [(0.1, 0.5)]


@virtual_time
async def test_keywords_and_nested_mappings_set_too():
    async with harness(Recorder) as lab:
        assert lab.set_parameters("recorder", rate_hz=5, noise={"joints": 1}) == ("rate_hz", "noise.joints")
        assert lab.graph.set_parameters(lab.node(Recorder), spare={"imu": 2}) == ("spare.imu", "spare.joints")


@virtual_time
async def test_one_wrong_value_refuses_the_whole(golden):
    async with harness(Recorder) as lab:
        node = lab.node(Recorder)
        before = node.parameters
        with pytest.raises(InvalidParameter) as caught:
            lab.set_parameters(Recorder, {"rate_hz": 20, "noise.imu": 11, "noise.jonts": 1})
        assert [fault.path for fault in caught.value.faults] == [("noise", "imu"), ("noise", "jonts")]
        golden(str(caught.value))
        assert node.parameters is before
        assert node.told == []
        assert lab.graph.report().nodes[0].parameters_set == 0


@virtual_time
async def test_read_only_parameter_accepts_its_own_value():
    async with harness(Recorder) as lab:
        said = "frame is read-only: it stays text 'imu_link' while the node runs"
        with pytest.raises(InvalidParameter, match=said):
            lab.set_parameters(Recorder, frame="other", rate_hz=20)
        assert lab.node(Recorder).parameters.rate_hz == 10
        assert lab.set_parameters(Recorder, frame="imu_link", rate_hz=20) == ("rate_hz",)


@virtual_time
async def test_same_values_change_nothing_and_notify_no_listener():
    async with harness(Recorder) as lab:
        node, events = lab.node(Recorder), lab.subscribe(ParameterEvent, "parameter_events")
        before = node.parameters
        assert lab.set_parameters(Recorder, {"rate_hz": 10, "noise": {"imu": 0.1}}) == ()
        assert lab.set_parameters(Recorder) == ()
        await lab.settle()
        assert node.parameters is before
        assert (node.told, events.latest) == ([], None)


@virtual_time
async def test_not_a_number_is_the_same_as_itself():
    async with harness(Recorder) as lab:
        assert lab.set_parameters(Recorder, {"noise.joints": math.nan}) == ("noise.joints",)
        assert lab.set_parameters(Recorder, {"noise.joints": math.nan}) == ()


@virtual_time
async def test_what_was_set_says_so():
    async with harness(Recorder) as lab:
        lab.set_parameters(Recorder, {"noise.imu": 0.5})
        rows = {row.name: row for row in store_of(lab.node(Recorder)).describe()}
        assert (rows["noise.imu"].value, str(rows["noise.imu"].source)) == (0.5, "set at run time")
        assert str(rows["noise.joints"].source) == "default"


def test_a_new_instance_takes_over_sources_and_count(golden):
    former, following = Recorder(), Recorder()
    assert store_of(former).set({"noise.imu": 0.5}).reason is None
    following.parameters = former.parameters
    store_of(following).take_over(store_of(former))
    sources = {row.name: str(row.source) for row in store_of(following).describe()}
    golden(sources["noise.imu"])
    assert sources["noise.joints"] == sources["rate_hz"] == "default"
    assert store_of(following).times_set == 1


def test_refusal_is_a_result_for_remote_callers(golden):
    result = store_of(Recorder()).set({"rate_hz": -1})
    assert result.changed == ()
    golden(result.reason)


# Timers.


@virtual_time
async def test_a_changed_period_starts_a_new_timer_grid():
    async with harness(Recorder) as lab:
        await lab.advance(0.25)
        lab.set_parameters(Recorder, rate_hz=4)
        await lab.advance(0.5)
        lab.set_parameters(Recorder, rate_hz=0)
        await lab.advance(10)
        lab.set_parameters(Recorder, rate_hz=1)
        await lab.advance(1)
        assert lab.node(Recorder).ticks == [0.1, 0.2, 0.5, 0.75, 11.75]
        steady = next(each for each in lab.graph.report().timers if each.name == "steady")
        assert (steady.fired, steady.missed) == (47, 0)


@virtual_time
async def test_another_parameters_change_keeps_the_timer_grid():
    async with harness(Recorder) as lab:
        await lab.advance(0.15)
        lab.set_parameters(Recorder, {"noise.imu": 0.5})
        await lab.advance(0.05)
        assert lab.node(Recorder).ticks == [0.1, 0.2]


@virtual_time
async def test_a_changed_period_does_not_revive_cancelled_timers():
    async with harness(Recorder) as lab:
        node = lab.node(Recorder)
        node.tick.cancel()
        lab.set_parameters(Recorder, rate_hz=2)
        await lab.advance(1)
        assert node.ticks == []
        node.tick.reset()
        await lab.advance(1)
        assert node.ticks == [1.5, 2.0]


class Unbounded(Parameters):
    period_s: float = 1.0


class Ticker(Node):
    parameters: Unbounded

    @timer("period_s")
    def tick(self) -> None: ...


@virtual_time
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, 1e-12])
async def test_an_impossible_timer_period_in_range_is_refused(value, golden):
    async with harness(Ticker) as lab:
        with golden.raises(InvalidParameter):
            lab.set_parameters(Ticker, period_s=value)
        assert lab.node(Ticker).tick.period_s == 1.0


# Threads.


class Caller(Node):
    async def run(self) -> None:
        self.changed = await self.run_sync(self.set_from_a_thread)

    def set_from_a_thread(self) -> tuple[str, ...]:
        return self.graph.set_parameters(Recorder, rate_hz=20)


@virtual_time
async def test_a_set_from_another_thread_waits_for_completion():
    caller = Caller()
    lab = harness(Recorder, caller)
    caller.graph = lab.graph
    async with lab:
        await lab.settle()
        assert caller.changed == ("rate_hz",)
        assert lab.node(Recorder).parameters.rate_hz == 20


@virtual_time
async def test_a_graph_that_has_ended_takes_no_parameters(golden):
    async with harness(Recorder) as lab:
        pass
    with golden.raises(NotRunning):
        lab.set_parameters(Recorder, rate_hz=20)


# The cases of ROS 2's own tests.


class Ranged(Parameters):
    int_param: int = 0
    dynamic: int | float | str | None = None
    bar: str | None = "bar"
    read_only: ReadOnly[int] = 1


class Cased(Node):
    parameters: Ranged


def refused(name, value):
    def check(store):
        before = store.current
        assert store.set({name: value}).faults
        assert store.current is before

    return check


def accepted(**changes):
    return lambda store: store.set(changes).faults == () or pytest.fail("refused")


def unknown(store):
    with pytest.raises(InvalidParameter) as caught:
        store.get("x")
    assert [(fault.code, fault.path) for fault in caught.value.faults] == [("unknown", ("x",))]


def none_of_both(store):
    assert store.set({"dynamic": 3, "int_param": "asd"}).faults
    assert (store.current.dynamic, store.current.int_param) == (None, 0)


def validated_then_told(store):
    order = []
    store.on_change.append(lambda old, _result: order.append((old.int_param, store.current.int_param)))
    assert store.set({"int_param": "asd"}).faults
    assert store.set({"int_param": 2}).changed
    assert order == [(0, 2)]


CHECKS = {
    "semantics/get-undeclared": [unknown],
    "semantics/describe-undeclared": [unknown],
    "semantics/set-undeclared": [refused("x", 1)],
    "semantics/set-atomically-undeclared": [refused("x", 1)],
    "semantics/undeclare-unknown": [refused("x", None)],
    "semantics/static-not-undeclared-by-none": [refused("int_param", None)],
    "semantics/dynamic-type": [accepted(dynamic="asd"), accepted(dynamic=3), accepted(dynamic=None)],
    "semantics/atomic-all-or-nothing": [none_of_both, accepted(dynamic=None, int_param=4)],
    "semantics/read-only-undeclare": [refused("read-only", None), refused("read-only", 2)],
    "semantics/undeclare-then-has": [accepted(bar=None), lambda store: store.get("bar")],
    "semantics/implicit-undeclare": [accepted(bar=None), lambda store: store.get("int_param")],
    "semantics/callbacks-order": [validated_then_told],
    "semantics/set-invalid-object": [refused("int_param", [42])],
}


@pytest.mark.parametrize("name", CHECKS)
def test_parameters_are_set_as_in_rclpy(name):
    store = store_of(Cased())
    for check in CHECKS[name]:
        check(store)
