"""`/parameter_events`: what ROS 2's nodes tell of their parameters, told only where somebody listens."""

import pytest

from busflow import Durability, Node, Parameters, QoS, publisher, subscription, supervised
from busflow.bus.bus import BusObserver
from busflow.errors import LaunchError
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.msgs.std_msgs import Float64
from busflow.node.parameter_messages import plain_value
from busflow.node.parameter_store import ParameterStore
from busflow.testing import harness, virtual_time


class Limits(Parameters):
    low: float = 0.0


class Settings(Parameters):
    gain: float = 1.0
    name: str = "left"
    limits: Limits | None = None


class Tuned(Node):
    parameters: Settings


class Watcher(Node):
    """Remembers what it hears."""

    async def start(self) -> None:
        self.heard: list[ParameterEvent] = []

    @subscription("/parameter_events")
    def on_event(self, event: ParameterEvent) -> None:
        self.heard.append(event)


def values(parameters):
    return {each.name: plain_value(each.value) for each in parameters}


@virtual_time
async def test_change_is_published_with_node_and_time():
    async with harness(Tuned) as lab:
        events = lab.subscribe(ParameterEvent, "parameter_events")
        await lab.advance(1.5)
        lab.set_parameters(Tuned, gain=2, name="right")
        event = events.latest
        assert event.node == "/tuned"
        assert event.stamp == lab.clock.now().to_msg()
        assert values(event.changed_parameters) == {"gain": 2.0, "name": "right"}
        assert (event.new_parameters, event.deleted_parameters) == ((), ())
        lab.set_parameters(Tuned, gain=3)
        assert values(events.latest.changed_parameters) == {"gain": 3.0}
        (publisher,) = lab.graph.bus.topics["/parameter_events"].publishers
        assert publisher.published == 2


@virtual_time
async def test_an_optional_group_is_reported_new_and_deleted():
    async with harness(Tuned) as lab:
        events = lab.subscribe(ParameterEvent, "parameter_events")
        lab.set_parameters(Tuned, limits={"low": 2})
        assert values(events.latest.new_parameters) == {"limits.low": 2.0}
        lab.set_parameters(Tuned, limits=None)
        assert values(events.latest.deleted_parameters) == {"limits.low": None}


@virtual_time
async def test_without_a_listener_there_is_no_topic():
    async with harness(Tuned) as lab:
        lab.set_parameters(Tuned, gain=2)
        assert "/parameter_events" not in lab.graph.bus.topics


class Shows(BusObserver):
    """Lets other processes see the parameters of each node, as a mirror does."""

    def parameters_added(self, store: ParameterStore) -> None:
        store.is_shown = True


@virtual_time
async def test_topic_is_there_where_others_look():
    lab = harness(Tuned)
    lab.graph.bus.observe(Shows())
    async with lab:
        (publisher,) = lab.graph.bus.topics["/parameter_events"].publishers
        assert publisher.published == 0
        assert lab.graph.report().topics == ()
        lab.set_parameters(Tuned, gain=2)
        assert publisher.published == 1
        assert [each.name for each in lab.graph.report().topics] == ["/parameter_events"]


@virtual_time
async def test_subscription_receives_all_parameters_first_then_changes():
    async with harness(Watcher, Tuned) as lab:
        lab.set_parameters(Tuned, gain=2)
        await lab.settle()
        first, second = lab.node(Watcher).heard
        assert values(first.new_parameters) == {"gain": 1.0, "name": "left"}
        assert values(second.changed_parameters) == {"gain": 2.0}
        assert not [problem for problem in lab.graph.plan().problems if problem.code == "nobody-publishes"]


@virtual_time
async def test_an_incompatible_parameter_subscription_fails_before_start():
    class Latched(Node):
        @subscription("/parameter_events", qos=QoS(durability=Durability.TRANSIENT_LOCAL))
        def on_event(self, event: ParameterEvent) -> None: ...

    with pytest.raises(LaunchError, match="parameter_events"):
        async with harness(Tuned, Latched):
            pass


@virtual_time
async def test_topic_of_another_type_is_logged(golden):
    class Squatter(Node):
        numbers = publisher(Float64, "/parameter_events")

    async with harness(Tuned, Squatter) as lab:
        lab.set_parameters(Tuned, gain=2)
        assert lab.node(Tuned).parameters.gain == 2
        (line,) = [each for each in lab.log if each.level == "warning" and each.node == "/tuned"]
        golden(line.event)
        assert "carries std_msgs/msg/Float64" in str(line.values["reason"])


@virtual_time
async def test_topic_of_another_type_stops_no_node(golden):
    class Squatter(Node):
        numbers = publisher(Float64, "/parameter_events")

    lab = harness(Squatter, Tuned)
    lab.graph.bus.observe(Shows())
    async with lab:
        (line,) = [each for each in lab.log if each.level == "warning"]
        assert line.node == "/tuned"
        golden(line.event)


@virtual_time
async def test_restarted_node_still_publishes():
    class Fragile(Tuned):
        @subscription("crash")
        def crash(self, _number: Float64) -> None:
            raise ValueError

    async with harness(supervised(Fragile(), restart="always"), Watcher) as lab:
        lab.publish("crash", Float64())
        await lab.advance(0.05)
        lab.set_parameters(Fragile, gain=5)
        assert [values(each.changed_parameters) for each in lab.node(Watcher).heard] == [{}]
        await lab.advance(1)
        lab.set_parameters(Fragile, gain=7)
        await lab.settle()
        published = [values((*each.new_parameters, *each.changed_parameters)) for each in lab.node(Watcher).heard]
        assert published == [{"gain": 1.0, "name": "left"}, {"gain": 5.0, "name": "left"}, {"gain": 7.0}]
