"""Tests of `call.py`: calls that wait for each other fail with the names of the chain."""

from __future__ import annotations

import asyncio

import pytest

from busflow import (
    DeadlockError,
    Node,
    ServiceFailed,
    client,
    service,
)
from busflow.errors import NodeFailed
from busflow.msgs.std_srvs import Trigger
from busflow.testing import harness, virtual_time
from tests.bus.conftest import accounts


class Chain(Node):
    """Answers by asking the next one."""

    def __init__(self, following: str, *, name: str) -> None:
        super().__init__(name=name)
        self.following = following

    def declare(self) -> None:
        self.create_service(Trigger, "~/step", self.step)
        self.next = self.create_client(Trigger, self.following)

    async def step(self, _request: Trigger.Request) -> Trigger.Response:
        return await self.next.call()


class End(Node):
    @service(Trigger, "end")
    async def end(self, _request: Trigger.Request) -> Trigger.Response:
        await self.clock.sleep(0.1)
        return Trigger.Response(success=True)


@virtual_time
async def test_a_chain_that_ends_is_no_deadlock():
    async with harness(Chain("b/step", name="a"), Chain("end", name="b"), End) as lab:
        answers = await asyncio.gather(*(lab.call(Trigger, "a/step") for _ in range(5)), lab.call(Trigger, "b/step"))
        assert all(answer.success for answer in answers)


@pytest.mark.parametrize("length", [1, 2, 3])
@virtual_time
async def test_a_circle_of_callers_is_named_at_once(golden, length):
    names = "abc"[:length]
    nodes = [Chain(f"{names[(at + 1) % length]}/step", name=each) for at, each in enumerate(names)]
    async with harness(*nodes) as lab:
        with golden.raises(ServiceFailed):
            await lab.call(Trigger, "a/step")
        assert lab.clock.seconds() == 0
        assert accounts(lab)


@virtual_time
async def test_start_calling_its_own_service_deadlocks(golden):
    class Impatient(Node):
        own = client(Trigger, "~/ready")

        @service(Trigger, "~/ready")
        def ready(self, _request: Trigger.Request) -> Trigger.Response:
            return Trigger.Response(success=True)

        async def start(self) -> None:
            await self.own.call()

    with golden.raises(NodeFailed):
        async with harness(Impatient):
            pass


@virtual_time
async def test_starts_waiting_for_each_other_deadlock(golden):
    class Starter(Node):
        def declare(self) -> None:
            self.create_service(Trigger, "~/ready", lambda _: Trigger.Response(success=True))
            self.other = self.create_client(Trigger, "right/ready" if self.name == "left" else "left/ready")

        async def start(self) -> None:
            await self.other.call()

    with golden.raises(NodeFailed):
        async with harness(Starter(name="left"), Starter(name="right")) as lab:
            assert lab.clock.seconds() == 0


@virtual_time
async def test_spawned_task_is_not_part_of_a_deadlock():
    class Later(Node):
        own = client(Trigger, "step")
        count = 0

        @service(Trigger, "step")
        async def step(self, _request: Trigger.Request) -> Trigger.Response:
            self.count += 1
            if self.count == 1:
                self.spawn(self.again())
                await self.clock.sleep(1)
            return Trigger.Response(success=True)

        async def again(self) -> None:
            await self.own.call()

    async with harness(Later) as lab:
        assert (await lab.call(Trigger, "step")).success
        await lab.settle()
        assert lab.node(Later).count == 2


@virtual_time
async def test_concurrent_calls_belong_to_their_handler():
    class Fork(Node):
        end = client(Trigger, "end")
        own = client(Trigger, "fork")

        @service(Trigger, "fork")
        async def fork(self, _request: Trigger.Request) -> Trigger.Response:
            ended, deadlock = await asyncio.gather(self.end.call(), self.own.call(), return_exceptions=True)
            return Trigger.Response(success=ended.success and isinstance(deadlock, DeadlockError))

    async with harness(Fork, End) as lab:
        assert (await lab.call(Trigger, "fork")).success
