"""Tests of `client.py`: each call gets an answer or one error, within its timeout."""

from __future__ import annotations

import asyncio
import threading
from functools import partial

import pytest

import busflow
from busflow import (
    DeadlockError,
    Node,
    ServiceTimeout,
    ServiceUnavailable,
    client,
    service,
)
from busflow.errors import IncompatibleType, NotRunning
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.testing import harness, virtual_time
from tests.bus.conftest import Add, Adder, accounts, line, three_calls


@virtual_time
async def test_a_server_that_comes_later_is_waited_for(golden):
    class Later(Node):
        async def run(self) -> None:
            await self.clock.sleep(3)
            self.create_service(Trigger, "later", lambda _: Trigger.Response(success=True))

    class Patient(Node):
        later = client(Trigger, "later")
        success = False

        async def run(self) -> None:
            with golden.raises(ServiceUnavailable):
                await self.later.ready(timeout=2)
            assert await self.later.ready(timeout=None)
            self.success = self.later.available and (await self.later.call()).success

    async with harness(Later, Patient) as lab:
        await lab.advance(2.5)
        assert not lab.node(Patient).later.available
        await lab.advance(0.5)
        assert lab.node(Patient).success


@virtual_time
async def test_missing_service_suggests_the_nearest(golden):
    async with harness(Adder) as lab:
        with golden.raises(ServiceUnavailable):
            await lab.call(Add, "adder/ad")
        assert lab.clock.seconds() == 0


@virtual_time
async def test_call_times_out_in_virtual_time(golden):
    async with harness(Adder) as lab:
        with golden.raises(ServiceTimeout):
            await lab.call(Add, "adder/never")
        assert lab.clock.seconds() == 5
        with pytest.raises(TimeoutError):
            await lab.call(Add, "adder/never", timeout=0.25)
        assert lab.clock.seconds() == 5.25
        assert (line(lab, "/adder/never").withdrawn, line(lab, "/adder/never").waiting) == (1, 1)
        assert accounts(lab)


@virtual_time
async def test_call_without_a_timeout_waits():
    async with harness(Adder) as lab:
        call = asyncio.create_task(lab.call(Add, "adder/never", timeout=None))
        await lab.advance(10_000)
        assert not call.done()
        call.cancel()


@pytest.mark.parametrize("limit_s", [0, -1, float("nan"), float("inf")])
@virtual_time
async def test_invalid_timeout_is_refused(limit_s):
    async with harness(Adder) as lab:
        asking = lab.node(Adder).create_client(Add, "adder/add")
        for wait in (asking.call, asking.ready, partial(lab.call, Add, "adder/add")):
            with pytest.raises(ValueError, match="timeout"):
                await wait(timeout=limit_s)


@virtual_time
async def test_cancelled_caller_withdraws_its_queued_request():
    async with harness(Adder) as lab:
        calls = await three_calls(lab)
        calls[0].cancel()
        calls[1].cancel()
        assert (await calls[2]).sum == 3
        assert lab.node(Adder).ended == [0, 2], "a request that had begun goes on"
        assert all(each.cancelled() for each in calls[:2])
        account = line(lab, "/adder/slow")
        assert (account.served, account.withdrawn, accounts(lab)) == (2, 1, True)


@virtual_time
async def test_a_call_that_is_thrown_away_is_withdrawn():
    async with harness(Adder) as lab:
        calls = await three_calls(lab)
        thrown = lab.graph.bus.services["/adder/slow"].call(Add.Request(), caller="/test")
        await asyncio.gather(*calls[:1])
        thrown.send(None)
        thrown.close()
        assert line(lab, "/adder/slow").withdrawn == 1
        await asyncio.gather(*calls)
        assert accounts(lab)


@virtual_time
async def test_answered_call_cancels_its_timeout():
    async with harness(Adder) as lab:
        await lab.call(Add, "adder/add", timeout=1000)
        assert [each for *_, each in asyncio.get_running_loop()._timers if not each.cancelled()] == []


@virtual_time
async def test_request_of_another_type_is_refused(golden):
    async with harness(Adder) as lab:
        with golden.raises(IncompatibleType):
            await lab.call(Add, "adder/add", SetBool.Request())
        with golden.raises(IncompatibleType):
            await lab.call(Add, "adder/add", Add.Request)
        with golden.raises(IncompatibleType):
            await lab.call(Trigger, "adder/add")
        with golden.raises(IncompatibleType):
            await lab.call(Trigger, "adder/slow")
        assert line(lab, "/adder/add").received == 0


def test_call_from_another_thread_is_refused(golden):
    refused = []

    async def main():
        async with busflow.launch(Adder) as graph:
            found = graph.bus.services["/adder/add"]

            def ask():
                with golden.raises(NotRunning) as caught:
                    asyncio.run(found.call(Add.Request(), caller="/thread"))
                refused.append(caught.value)

            thread = threading.Thread(target=ask)
            thread.start()
            thread.join(60)

    asyncio.run(main())
    assert len(refused) == 1


@virtual_time
async def test_closed_client_calls_nothing(golden):
    async with harness(Adder) as lab:
        asking = lab.node(Adder).create_client(Add, "adder/add")
        assert (await asking.call()).sum == 1
        golden(repr(asking))
        for _ in range(2):
            asking.close()
        with golden.raises(NotRunning):
            await asking.call()


# Calls that are not waited for.


@virtual_time
async def test_begun_calls_are_counted_by_their_ends():
    async with harness(Adder) as lab:
        ask = lab.node(Adder).create_client(Add, "adder/add")
        missing = lab.node(Adder).create_client(Trigger, "missing")
        answered, withdrawn = ask.begin(Add.Request(number=1)), ask.begin(Add.Request(number=2))
        ask.end(withdrawn)
        failed = missing.begin(Trigger.Request())
        missing.end(failed)
        assert await ask.answer(answered) == answered.outcome
        assert isinstance(answered.outcome, Add.Response)
        assert isinstance(failed.outcome, ServiceUnavailable)
        mine, other = ask.statistics(), missing.statistics()
        assert (mine.called, mine.answered, mine.cancelled, mine.waiting) == (2, 1, 1, 0)
        assert (other.called, other.failed, other.waiting) == (1, 1, 0)


@virtual_time
async def test_begun_call_that_closes_a_circle_is_refused(golden):
    class Circular(Node):
        again = client(Trigger, "~/step")
        begun = None

        @service(Trigger, "~/step")
        async def step(self, _request: Trigger.Request) -> Trigger.Response:
            self.begun = self.again.begin(Trigger.Request(), timeout=1)
            with golden.raises(DeadlockError):
                self.again.refuse_cycle(self.begun)
            return Trigger.Response()

    async with harness(Circular) as lab:
        await lab.call(Trigger, "circular/step")
        assert isinstance(lab.node(Circular).begun.outcome, DeadlockError)
