"""Service events in bags of ROS 2, which hold the definition of the service but none of its events."""

from pathlib import Path

from busflow.recording.bag.bag import Bag

BAGS = Path(__file__).parents[2] / "cases/rosbag2"


def test_service_events_are_read_from_the_services_definition():
    with Bag(BAGS / "add_two_ints/topics_and_services.mcap") as bag:
        events = [each.channel.plain(each.payload) for each in bag.entries(["/add_two_ints/_service_event"])]
    asked = [(each["info"]["sequence_number"], *each["request"], *each["response"]) for each in events]
    assert asked == [
        (1, {"a": 1, "b": 3}),
        (1, {"sum": 4}),
        (2, {"a": 2, "b": 3}),
        (2, {"sum": 5}),
        (3, {"a": 3, "b": 3}),
        (3, {"sum": 6}),
    ]
    assert {len(each["info"]["client_gid"]) for each in events} == {16}
