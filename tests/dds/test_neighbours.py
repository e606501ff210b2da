"""What the gid of a neighbour tells: tests of `NeighbourEnd`, and of the requests that a server of the run gets.

The gids are those that `ros2 topic info -v` showed for a node with Fast DDS (RobotWebTools/rosbridge_suite#1022) and
one with Cyclone (swri-robotics/swri_console#54).
"""

from types import SimpleNamespace
from uuid import UUID

import pytest

from busflow.dds.calls import OTHER_SERVICES, RunServer
from busflow.dds.carried import Carried
from busflow.dds.names import DdsName, NameUse
from busflow.dds.neighbours import NeighbourEnd
from busflow.wire.zenoh.qos_text import WireQoS

FAST = bytes.fromhex("010ffb07530091ca0000000000001b03")
CYCLONE = bytes.fromhex("011027e5f4890245d0cb9c2f00001504")


def end(gid, use, *, describes_type=False):
    name = DdsName(use, "/arm/stop")
    return NeighbourEnd(
        gid, gid, name, "std_srvs/srv/Trigger_Request", None, WireQoS(), is_writer=True, describes_type=describes_type
    )


def test_only_cyclones_services_can_cross():
    """`rmw_response.cpp` of ros2/rmw_fastrtps 9.2 has the request's identity in the inline QoS, not before the body."""
    assert end(CYCLONE, NameUse.REQUEST).can_cross
    assert not end(FAST, NameUse.REQUEST).can_cross
    assert not end(FAST, NameUse.REPLY).can_cross
    assert end(FAST, NameUse.TOPIC).can_cross


def test_described_type_of_another_dds_may_not_match():
    """`TypeSupport_impl.cpp` of rmw_fastrtps for Fast DDS 3 describes types, which `EDP.cpp` compares with ours."""
    assert end(FAST, NameUse.TOPIC, describes_type=True).may_not_match
    assert not end(FAST, NameUse.TOPIC).may_not_match
    assert not end(CYCLONE, NameUse.TOPIC, describes_type=True).may_not_match


class Parts:
    """What a server needs of the bridge, without DDS: requests come from a writer with this gid."""

    def __init__(self, gid):
        self.asked, self.lines, self.take = [], [], None
        self.carried = Carried(self.lines.append)
        self.peer = SimpleNamespace(key=lambda _kind: "key")
        self.intake = SimpleNamespace(add=lambda _reader, take: setattr(self, "take", take))
        self.sender = SimpleNamespace(hand=lambda work, _size: self.asked.append(work))
        self.reader = SimpleNamespace(get_matched_publication_data=lambda _: SimpleNamespace(key=UUID(bytes=gid)))

    def ends(self, _kind, *, is_server):
        return self.reader, None, is_server


@pytest.mark.parametrize(("gid", "asked", "lines"), [(CYCLONE, 1, []), (FAST, 0, [OTHER_SERVICES])])
def test_server_gets_no_request_without_header(gid, asked, lines):
    parts = Parts(gid)
    RunServer(SimpleNamespace(name="/arm/stop"), parts)
    info = SimpleNamespace(valid_data=True, publication_handle=1)
    parts.take([SimpleNamespace(sample_info=info, payload=b"\0\1\0\0" + bytes(20))])
    assert (len(parts.asked), parts.lines) == (asked, lines)
