"""The services of a run's nodes are shown to other processes."""

import pytest

from tests.nodes.lamp import Lamp


@pytest.mark.asyncio
async def test_the_graph_of_a_run_shows_its_services(looked_at):
    async with looked_at(Lamp) as looked:
        services = (await looked.ask(looked.peer.graph)).services
        assert [(name, each.type) for name, each in services.items()] == [
            ("/lamp/get_logger_levels", "rcl_interfaces/srv/GetLoggerLevels"),
            ("/lamp/never", "std_srvs/srv/Trigger"),
            ("/lamp/set_logger_levels", "rcl_interfaces/srv/SetLoggerLevels"),
            ("/lamp/switch", "std_srvs/srv/SetBool"),
        ]
        assert [end.node for end in services["/lamp/switch"].publishers] == ["/lamp"]
