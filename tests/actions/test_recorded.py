"""A run with actions is recorded whole, and each of its sides can be run again on the recording."""

import pytest

from busflow.cli import main

ARM = """
from tests.actions import conftest


class Arm(conftest.Arm):
    '''An arm.'''
"""
BOSS = """
from busflow import Node, action_client, publisher
from busflow.msgs.std_msgs import Float64
from tests.actions.conftest import MoveTo


class Boss(Node):
    move = action_client(MoveTo, "arm/move")
    reached = publisher(Float64, "reached")

    async def run(self) -> None:
        for angle in (1, 2):
            result = await self.move.run(MoveTo.Goal(angle=angle))
            self.reached.publish(Float64(data=result.angle))
        async with self.move.send(MoveTo.Goal(angle=9)):
            await self.clock.sleep(1.5)
"""


@pytest.fixture
def recording(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.py").write_text(ARM)
    (tmp_path / "boss.py").write_text(BOSS)
    text = "name: moves\nplugins: [.]\nnodes:\n  arm: {plugin: arm}\n  boss: {plugin: boss}\n"
    (tmp_path / "graph.yaml").write_text(text)
    assert main(["run", "graph.yaml", "--sim", "--for", "8s", "--record", "moves.mcap"]) == 0
    return tmp_path / "moves.mcap"


@pytest.mark.parametrize("node", ["arm", "boss"])
def test_each_side_replays_as_recorded(recording, node, capsys):
    assert main(["replay", str(recording), "graph.yaml", "--node", node]) == 0
    assert f"/{node}: the same as in" in capsys.readouterr().out


def test_all_parts_of_an_action_are_recorded(recording, capsys):
    assert main(["bag", "info", str(recording)]) == 0
    found = {line.split()[0] for line in capsys.readouterr().out.splitlines() if "/_action/" in line}
    events = {f"/arm/move/_action/{each}/_service_event" for each in ("send_goal", "cancel_goal", "get_result")}
    assert found == events | {"/arm/move/_action/feedback", "/arm/move/_action/status"}
