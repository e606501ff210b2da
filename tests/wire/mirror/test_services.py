"""The services of a run's nodes are shown to other processes."""

import pytest

from busflow.wire.client.client import join


@pytest.mark.usefixtures("room")
def test_the_graph_of_a_run_shows_its_services():
    with join() as peer:
        services = peer.graph().services
        assert [(name, each.type) for name, each in services.items()] == [
            ("/lamp/never", "std_srvs/srv/Trigger"),
            ("/lamp/switch", "std_srvs/srv/SetBool"),
        ]
        assert [end.node for end in services["/lamp/switch"].publishers] == ["/lamp"]
