"""The talker's greetings arrive, at the rate that the launch file says."""

from pathlib import Path

from busflow.msgs.std_msgs import String
from busflow.testing import harness, virtual_time

FILE = Path(__file__).parent / "talker.yaml"


@virtual_time
async def test_every_greeting_is_logged():
    async with harness(FILE, args={"rate_hz": 2}) as lab:
        await lab.advance(60)
        said = [message.data for message in lab.received("chatter", String)]
        assert said == [f"hello {count}" for count in range(1, 121)]
        assert [record.values["text"] for record in lab.log] == said
