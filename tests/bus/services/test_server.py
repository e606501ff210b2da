"""Tests of `server.py`: one request at a time, every request accounted for, errors passed to the caller."""

from __future__ import annotations

import asyncio

import pytest

from busflow import (
    Node,
    ServiceFailed,
    ServiceGone,
    ServiceUnavailable,
    client,
    service,
)
from busflow.errors import NotRunning
from busflow.msgs.std_srvs import Trigger
from busflow.node.node import runtime_of
from busflow.testing import harness, virtual_time
from tests.bus.conftest import Add, Adder, accounts, line, three_calls


@virtual_time
async def test_requests_are_served_one_by_one_in_order():
    async with harness(Adder) as lab:
        calls = await three_calls(lab)
        await lab.advance(0.5)
        assert lab.node(Adder).began == [0]
        assert line(lab, "/adder/slow").waiting == 3
        await lab.advance(2.5)
        assert [each.result().sum for each in calls] == [1, 2, 3]


@virtual_time
async def test_request_waits_until_its_server_has_started():
    class Late(Adder):
        async def start(self) -> None:
            await self.clock.sleep(2)
            await super().start()

    class Early(Node):
        late = client(Add, "late/add")

        async def start(self) -> None:
            await self.late.ready()
            self.sum = (await self.late.call()).sum
            self.at = self.clock.seconds()

    async with harness(Early, Late) as lab:
        assert (lab.node(Early).sum, lab.node(Early).at) == (1, 2.0)


@virtual_time
async def test_handler_error_reaches_caller_and_server_log(golden):
    async with harness(Adder) as lab:
        with golden.raises(ServiceFailed) as caught:
            await lab.call(Add, "adder/wrong", Add.Request(number=4))
        assert isinstance(caught.value.__cause__, ValueError)
        (record,) = [record for record in lab.log if record.level == "error"]
        assert record.node == "/adder"
        golden(record.event, "log")
        assert record.values["traceback"][-1].endswith("in fail")
        assert await lab.call(Add, "adder/add") == Add.Response(sum=1)
        assert (line(lab, "/adder/wrong").failed, accounts(lab)) == (1, True)


@virtual_time
async def test_a_handler_that_returns_no_response_has_failed(golden):
    class Forgetful(Node):
        @service(Add, "nothing")
        def nothing(self, _request: Add.Request):
            pass

        @service(Add, "other")
        async def other(self, _request: Add.Request):
            return Trigger.Response()

        def declare(self) -> None:
            self.create_service(Add, "coroutine", lambda request: self.other(request))  # noqa: PLW0108  # it is plain

    async with harness(Forgetful) as lab:
        for name in ("nothing", "other", "coroutine"):
            with golden.raises(ServiceFailed, name):
                await lab.call(Add, name)


@virtual_time
async def test_ended_server_fails_its_waiting_calls(golden):
    async with harness(Adder, expect_failure=Adder) as lab:
        calls = [asyncio.create_task(lab.call(Add, "adder/slow", Add.Request(number=n))) for n in range(2)]
        await lab.settle()
        lab.fail(Adder, RuntimeError("planted"))
        for each in await asyncio.gather(*calls, return_exceptions=True):
            assert isinstance(each, ServiceGone)
            golden(str(each))
        with golden.raises(ServiceUnavailable):
            await lab.graph.bus.services["/adder/slow"].call(Add.Request(), caller="/test")
        assert (line(lab, "/adder/slow").lost, accounts(lab)) == (2, True)


@virtual_time
async def test_a_graph_that_stops_leaves_no_caller_waiting(golden):
    async with harness(Adder) as lab:
        call = asyncio.create_task(lab.call(Add, "adder/never", timeout=None))
        await lab.settle()
    with pytest.raises(ServiceGone):
        await call
    with golden.raises(NotRunning):
        await lab.call(Add, "adder/add")
    assert accounts(lab)


@virtual_time
async def test_system_exit_in_a_handler_fails_the_node():
    class Leaver(Node):
        @service(Trigger, "leave")
        async def leave(self, _request: Trigger.Request) -> Trigger.Response:
            raise SystemExit(3)

    async with harness(Leaver, expect_failure=Leaver) as lab:
        with pytest.raises(ServiceGone):
            await lab.call(Trigger, "leave")


@virtual_time
async def test_request_to_a_full_server_is_refused(golden):
    async with harness(Adder) as lab:
        calls = await three_calls(lab)
        with golden.raises(ServiceUnavailable):
            await lab.call(Add, "adder/slow")
        assert [each.sum for each in await asyncio.gather(*calls)] == [1, 2, 3]
        assert (line(lab, "/adder/slow").refused, accounts(lab)) == (1, True)


@virtual_time
async def test_restarted_server_continues_its_account():
    class Phoenix(Node):
        def declare(self) -> None:
            self.rise()

        def rise(self) -> None:
            self.server = self.create_service(Trigger, "~/work", self.work)

        async def work(self, _request: Trigger.Request) -> Trigger.Response:
            await self.clock.sleep(0.1)
            return Trigger.Response(success=True)

    async with harness(Phoenix) as lab:
        for _ in range(3):
            call = asyncio.create_task(lab.call(Trigger, "phoenix/work"))
            await lab.settle()
            lab.node(Phoenix).server.close()
            with pytest.raises(ServiceGone):
                await call
            with pytest.raises(ServiceUnavailable):
                await lab.call(Trigger, "phoenix/work")
            lab.node(Phoenix).rise()
            assert (await lab.call(Trigger, "phoenix/work")).success
        account = line(lab, "/phoenix/work")
        assert (account.received, account.served, account.lost, accounts(lab)) == (6, 3, 3, True)


@virtual_time
async def test_a_server_shows_its_service_node_and_counts(golden):
    async with harness(Adder) as lab:
        server = lab.node(Adder).create_service(Trigger, "ask", lambda _: Trigger.Response())
        await lab.call(Trigger, "ask")
        golden(repr(server))


@virtual_time
async def test_request_in_anothers_name_is_accounted_for():
    async with harness(Adder) as lab:
        (server,) = (each for each in runtime_of(lab.node(Adder)).endpoints.servers if each.service == "/adder/add")
        seen = []
        lab.graph.bus.services["/adder/add"].taps.append(lambda call: seen.append((call.caller, call.outcome)))
        call = server.ask(Add.Request(number=2), caller="one that has gone")
        await lab.advance(0)
        assert seen == [("one that has gone", None), ("one that has gone", Add.Response(sum=3))]
        assert (call.reply.result().sum, accounts(lab)) == (3, True)
