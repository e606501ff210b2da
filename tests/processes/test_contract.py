"""Two nodes notice nothing of where they are: every pair is run in one process and in two."""

import pytest

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
    "both ways": """
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
}
IMPORTS = """
from busflow import *
from busflow import QoS
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import SetBool

"""


@pytest.mark.parametrize("apart", [False, True], ids=["together", "apart"])
@pytest.mark.parametrize("pair", PAIRS)
def test_a_pair_of_nodes(start, pair, apart):
    text = f"""
processes: {{other: {{}}}}
nodes:
  second: {{plugin: "pair:Second"}}
  first: {{plugin: "pair:First"{", process: other" if apart else ""}}}
"""
    run = start(text, files={"plugins/pair.py": f"{IMPORTS}{PAIRS[pair]}"})
    run.wait_for('"event": "holds"')
    run.wait_for('"event": "holds"', '"what": true')
    run.end()
