"""Tests of `service.py`: names, types, one server per service, remote ends, and one outcome per call."""

from __future__ import annotations

import asyncio

import anyio
import pytest

import busflow
from busflow import (
    Client,
    DeadlockError,
    Node,
    Server,
    ServiceError,
    ServiceFailed,
    ServiceTimeout,
    ServiceUnavailable,
    client,
    service,
)
from busflow.bus.bus import BusObserver
from busflow.bus.services.call import Call
from busflow.bus.services.service import Service
from busflow.errors import DuplicateServer, LaunchError
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.testing import explore, harness, virtual_time
from tests.bus.conftest import Add, Adder, accounts, line

# Answers.


@virtual_time
async def test_call_returns_the_answer_in_no_time():
    async with harness(Adder) as lab:
        assert await lab.call(Add, "adder/add", Add.Request(number=2)) == Add.Response(sum=3)
        assert await lab.call(Add, "adder/add") == Add.Response(sum=1)
        assert lab.clock.seconds() == 0
        assert (line(lab, "/adder/add").received, line(lab, "/adder/add").served) == (2, 2)
        assert accounts(lab)


@virtual_time
async def test_endpoints_created_in_declare_or_later_work_alike():
    class Maker(Node):
        def declare(self) -> None:
            self.server = self.create_service(Add, "~/add", lambda request: Add.Response(sum=request.number), depth=3)
            self.client = self.create_client(Add, "~/add")

        async def run(self) -> None:
            self.create_service(Trigger, "later", self.later)

        async def later(self, _request: Trigger.Request) -> Trigger.Response:
            return Trigger.Response(success=(await self.client.call(Add.Request(number=7))).sum == 7)

    async with harness(Maker) as lab:
        assert not lab.node(Maker).create_client(SetBool, "nobody").available
        assert (await lab.call(Trigger, "later")).success
        assert (line(lab, "/maker/add").depth, line(lab, "/later").depth) == (3, 10)


# Errors, each at once.


def test_a_graph_in_real_time_answers_too():
    async def main():
        async with busflow.launch(Adder) as graph:
            assert (await graph.call(Add, "adder/add", Add.Request(number=1))).sum == 2
            with pytest.raises(ServiceTimeout):
                await graph.call(Add, "adder/never", timeout=0.01)

    asyncio.run(main())


# Before the start.


class Asker(Node):
    ask = client(Add, "adder/ad")


class Other(Node):
    @service(Add, "adder/add")
    def add(self, _request: Add.Request) -> Add.Response:
        return Add.Response()


class Wrong(Node):
    ask = client(Trigger, "adder/add")


@pytest.mark.parametrize(
    ("node", "code", "severity"),
    [(Asker, "nobody-answers", "warning"), (Other, "two-servers", "error"), (Wrong, "type-mismatch", "error")],
)
def test_mistake_between_services_is_found_before_the_start(golden, node, code, severity):
    (found,) = busflow.launch(Adder, node).plan().problems
    assert (found.code, found.severity.value) == (code, severity)
    golden(f"{found.message}: {found.fix}")
    (found,) = busflow.launch(Adder, node, strict=True).plan().errors
    with pytest.raises(LaunchError):
        asyncio.run(busflow.launch(Adder, node, strict=True).start())


@virtual_time
async def test_a_second_server_at_run_time_is_refused(golden):
    class Second(Node):
        async def run(self) -> None:
            with golden.raises(DuplicateServer):
                self.create_service(Add, "adder/add", lambda _: Add.Response())
            self.refused = True

    async with harness(Adder, Second) as lab:
        await lab.settle()
        assert lab.node(Second).refused
        assert (await lab.call(Add, "adder/add")).sum == 1


def test_names_are_expanded_and_remapped_as_topics_are(tmp_path):
    (tmp_path / "adder.py").write_text(
        "from busflow import Node, client, service\n"
        "from busflow.msgs.std_srvs import Trigger\n"
        "class Adder(Node):\n"
        "    ask = client(Trigger, 'plain')\n"
        "    @service(Trigger, '~/reset')\n"
        "    def reset(self, request: Trigger.Request) -> Trigger.Response:\n"
        "        return Trigger.Response()\n"
    )
    file = tmp_path / "graph.yaml"
    text = "plugins: [.]\nnodes:\n  one:\n    plugin: adder\n    namespace: left\n    remap: {plain: /left/one/reset}\n"
    file.write_text(text)
    plan = busflow.launch(file).plan()
    assert plan.problems == []
    (planned,) = plan.nodes
    assert [each.service for each in (*planned.servers, *planned.clients)] == ["/left/one/reset", "/left/one/reset"]
    file.write_text(text.replace("plain:", "plane:"))
    found = [(problem.code, problem.fix) for problem in busflow.launch(file).plan().errors]
    assert found == [("unused-remap", "did you mean 'plain'?")]


# What others see of it.


@virtual_time
async def test_observer_gets_services_servers_and_clients():
    came, went = [], []

    class Changes(BusObserver):
        def service_added(self, service):
            came.append((Service, service.name))

        def server_added(self, server):
            came.append((Server, server.service))

        def client_added(self, client):
            came.append((Client, client.service))

        def endpoint_removed(self, end):
            if isinstance(end, Server | Client):
                went.append((type(end), end.service))

    async with harness(Adder, Asker) as lab:
        lab.graph.bus.observe(Changes())
        there, came[:] = set(came), ()
        await lab.call(Add, "adder/add")
        lab.node(Adder).create_service(Trigger, "later", lambda _: Trigger.Response())
        assert {(Service, "/adder/add"), (Service, "/adder/ad")} <= there
        assert came == [(Client, "/adder/add"), (Service, "/later"), (Server, "/later")]
    assert {(Server, "/adder/add"), (Client, "/adder/add"), (Client, "/adder/ad")} <= {*went}


class Elsewhere:
    """Stands for a server of another process."""

    node = "/elsewhere"

    def __init__(self):
        self.calls: list[Call] = []
        self.withdrawn: list[int] = []

    def holder(self, _call):
        return None

    def accept(self, call):
        self.calls.append(call)

    def withdraw(self, call):
        self.withdrawn.append(call.number)

    def statistics(self):
        return None


@virtual_time
async def test_remote_server_answers_like_a_local_one(golden):
    class Asking(Node):
        away = client(Trigger, "away")

        @service(Trigger, "ask")
        async def ask(self, _request: Trigger.Request) -> Trigger.Response:
            return await self.away.call(timeout=1)

    async with harness(Asking) as lab:
        away = lab.graph.bus.service("/away", Trigger, "the wire")
        there = Elsewhere()
        away.join(there)
        calls = [asyncio.create_task(lab.call(Trigger, "away", timeout=1)) for _ in range(3)]
        calls.append(asyncio.create_task(lab.call(Trigger, "ask")))
        await lab.settle()
        there.calls[0].succeed(Trigger.Response(message="from elsewhere"))
        there.calls[1].fail(ServiceFailed("it did not work"))
        assert (await calls[0]).message == "from elsewhere"
        with golden.raises(ServiceFailed):
            await calls[1]
        with golden.raises(ServiceTimeout):
            await calls[2]
        with golden.raises(ServiceFailed):
            await calls[3]
        assert set(there.withdrawn) == {2, 3, 4}
        away.leave(there)
        with pytest.raises(ServiceUnavailable):
            await lab.call(Trigger, "away")


@virtual_time
async def test_server_that_came_twice_is_awaited_once():
    async with harness(Adder) as lab:
        away, there = lab.graph.bus.service("/away", Trigger, "the wire"), Elsewhere()
        waiting = [asyncio.create_task(away.wait_for_server(5)) for _ in range(2)]
        await lab.settle()
        away.join(there)
        away.leave(there)
        away.join(there)
        await asyncio.gather(*waiting)


@virtual_time
async def test_remote_caller_is_served_like_a_local_one():
    async with harness(Adder) as lab:
        found = lab.graph.bus.services["/adder/add"]
        assert await found.call(Add.Request(number=1), caller="/elsewhere/asker") == Add.Response(sum=2)
        with pytest.raises(ServiceFailed):
            await lab.graph.bus.services["/adder/wrong"].call(Add.Request(), caller="/elsewhere/asker")
        assert accounts(lab)


# What is known to go wrong elsewhere.


@virtual_time
async def test_handler_calling_its_own_service_gets_deadlock_error(golden):
    class Reentrant(Node):
        own = client(Trigger, "own")

        @service(Trigger, "own")
        async def answer(self, _request: Trigger.Request) -> Trigger.Response:
            self.create_service(Add, "made", lambda request: Add.Response(sum=request.number))
            made = await self.create_client(Add, "made").call(Add.Request(number=3))
            with golden.raises(DeadlockError):
                await self.own.call()
            return Trigger.Response(success=made.sum == 3)

    async with harness(Reentrant) as lab:
        assert (await lab.call(Trigger, "own")).success
        assert lab.clock.seconds() == 0


# Under many orders of events, with failures.


class Worker(Node):
    """Answers quickly or slowly, or fails."""

    async def start(self) -> None:
        self.under_way = 0

    @service(Add, "~/work", depth=3)
    async def work(self, request: Add.Request) -> Add.Response:
        self.under_way += 1
        assert self.under_way == 1, "one request at a time"
        try:
            if request.number % 3 == 1:
                await self.clock.sleep(0.1)
            if request.number % 5 == 4:
                raise ValueError("planted")
            return Add.Response(sum=request.number + 1)
        finally:
            self.under_way -= 1

    @service(Add, "~/pass_on", depth=3)
    async def pass_on(self, request: Add.Request) -> Add.Response:
        return await self.other.call(request, timeout=0.15)

    def declare(self) -> None:
        other = "right" if self.name == "left" else "left"
        self.other = self.create_client(Add, f"{other}/{'pass_on' if self.name == 'left' else 'work'}")


async def storm(lab):
    """Calls from several tasks, some of which give up, while one of the nodes fails."""
    outcomes = []

    async def ask(number):
        name = ("left/work", "right/work", "left/pass_on", "right/pass_on")[number % 4]
        try:
            with anyio.move_on_after(0.12 if number % 7 == 6 else None):
                answer = await lab.call(Add, name, Add.Request(number=number), timeout=0.3)
                assert answer.sum == number + 1
                outcomes.append("answered")
                return
            outcomes.append("cancelled")
        except ServiceError as error:
            outcomes.append(type(error).__name__)

    asked = [asyncio.create_task(ask(number)) for number in range(16)]
    await lab.advance(0.1)
    lab.fail("right", RuntimeError("planted"))
    asked += [asyncio.create_task(ask(number)) for number in range(16, 24)]
    await lab.advance(0.5)
    assert all(each.done() for each in asked), "no call is stuck"
    await asyncio.gather(*asked)
    return outcomes


@explore(schedules=50)  # a thousand pass too
async def test_every_call_has_exactly_one_outcome():
    async with harness(Worker(name="left"), Worker(name="right"), expect_failure="right") as lab:
        outcomes = await storm(lab)
        assert len(outcomes) == 24
        assert {"answered", "ServiceFailed", "ServiceUnavailable"} <= set(outcomes)
        assert accounts(lab)
    assert all(server.waiting == 0 for each in lab.graph.report().services for server in each.servers)
    assert all(asking.waiting == 0 for each in lab.graph.report().services for asking in each.clients)
    assert accounts(lab)
