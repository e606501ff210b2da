"""Services in a graph: an answer or one error, at once; one request at a time; every call accounted for."""

from __future__ import annotations

import asyncio
import json
import threading
from pathlib import Path

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
    ServiceGone,
    ServiceTimeout,
    ServiceType,
    ServiceUnavailable,
    client,
    service,
    subscription,
    timer,
)
from busflow.bus.call import Call
from busflow.errors import DuplicateServer, IncompatibleType, LaunchError, NodeFailed, NotRunning
from busflow.interfaces.message import Message
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.testing import explore, harness, virtual_time


class Add(ServiceType, package="test"):
    """Adds one, and says to what."""

    class Request(Message):
        number: int = 0

    class Response(Message):
        sum: int = 0


class Adder(Node):
    """Answers at once, after a while, wrongly, never."""

    async def start(self) -> None:
        self.began: list[int] = []
        self.ended: list[int] = []

    @service(Add, "~/add")
    def add(self, request: Add.Request) -> Add.Response:
        self.began.append(request.number)
        return Add.Response(sum=request.number + 1)

    @service(Add, "~/slow", depth=2)
    async def add_slowly(self, request: Add.Request) -> Add.Response:
        self.began.append(request.number)
        await self.clock.sleep(1.0)
        self.ended.append(request.number)
        return Add.Response(sum=request.number + 1)

    @service(Add, "~/wrong")
    def fail(self, request: Add.Request) -> Add.Response:
        raise ValueError(f"cannot add to {request.number}")

    @service(Add, "~/never")
    async def hang(self, _request: Add.Request) -> Add.Response:
        await anyio.sleep_forever()
        raise AssertionError


def line(lab, name):
    """The account of a service's only server."""
    (found,) = lab.graph.bus.services[name].statistics().servers
    return found


def accounts(lab):
    """Whether both ends of every service account for every call."""
    return all(
        server.received
        == server.served + server.failed + server.refused + server.withdrawn + server.lost + server.waiting
        for each in lab.graph.report().services
        for server in each.servers
    ) and all(
        asking.called == asking.answered + asking.failed + asking.cancelled + asking.waiting
        and asking.failed == sum(asking.errors.values())
        for each in lab.graph.report().services
        for asking in each.clients
    )


async def three_calls(lab):
    """Three of the slow service: one with the handler, two that wait."""
    calls = []
    for number in range(3):
        calls.append(asyncio.create_task(lab.call(Add, "adder/slow", Add.Request(number=number))))
        await lab.settle()
    return calls


# Answers.


@virtual_time
async def test_a_call_gives_the_answer_and_no_time_passes():
    async with harness(Adder) as lab:
        assert await lab.call(Add, "adder/add", Add.Request(number=2)) == Add.Response(sum=3)
        assert await lab.call(Add, "adder/add") == Add.Response(sum=1)
        assert lab.clock.seconds() == 0
        assert (line(lab, "/adder/add").received, line(lab, "/adder/add").served) == (2, 2)
        assert accounts(lab)


@virtual_time
async def test_nodes_ask_each_other():
    class Asker(Node):
        adder = client(Add, "adder/slow")
        heard = 0

        @subscription("numbers")
        async def on_number(self, number: Int64) -> None:
            self.heard = (await self.adder.call(Add.Request(number=number.data))).sum

    async with harness(Adder, Asker) as lab:
        lab.publish("numbers", Int64(data=5))
        await lab.advance(0.9)
        assert (lab.node(Asker).heard, lab.node(Asker).adder.statistics().waiting) == (0, 1)
        await lab.advance(0.1)
        assert (lab.node(Asker).heard, lab.node(Asker).adder.statistics().waiting) == (6, 0)


@virtual_time
async def test_one_request_at_a_time_first_come_first_served():
    async with harness(Adder) as lab:
        calls = await three_calls(lab)
        await lab.advance(0.5)
        assert lab.node(Adder).began == [0]
        assert line(lab, "/adder/slow").waiting == 3
        await lab.advance(2.5)
        assert [each.result().sum for each in calls] == [1, 2, 3]


@virtual_time
async def test_a_request_before_its_server_has_started_waits_for_that():
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
async def test_endpoints_made_in_declare_and_later_are_the_same():
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


@virtual_time
async def test_a_server_that_comes_later_is_waited_for():
    class Later(Node):
        async def run(self) -> None:
            await self.clock.sleep(3)
            self.create_service(Trigger, "later", lambda _: Trigger.Response(success=True))

    class Patient(Node):
        later = client(Trigger, "later")
        success = False

        async def run(self) -> None:
            with pytest.raises(ServiceUnavailable, match="nobody answers /later"):
                await self.later.ready(timeout=2)
            await self.later.ready(timeout=None)
            self.success = self.later.available and (await self.later.call()).success

    async with harness(Later, Patient) as lab:
        await lab.advance(2.5)
        assert not lab.node(Patient).later.available
        await lab.advance(0.5)
        assert lab.node(Patient).success


# Errors, each at once.


@virtual_time
async def test_a_service_that_nobody_answers_names_the_nearest():
    async with harness(Adder) as lab:
        with pytest.raises(ServiceUnavailable, match=r"nobody answers /adder/ad; did you mean '/adder/add'\?"):
            await lab.call(Add, "adder/ad")
        assert lab.clock.seconds() == 0


@virtual_time
async def test_what_the_handler_raises_is_told_to_the_caller_and_logged_by_the_server_which_goes_on():
    async with harness(Adder) as lab:
        with pytest.raises(ServiceFailed, match="/adder/wrong failed in /adder: ValueError: cannot add to 4") as caught:
            await lab.call(Add, "adder/wrong", Add.Request(number=4))
        assert isinstance(caught.value.__cause__, ValueError)
        (record,) = [record for record in lab.log if record.level == "error"]
        assert record.node == "/adder"
        assert "Adder.fail (service /adder/wrong): ValueError: cannot add to 4" in record.event
        assert record.values["traceback"][-1].endswith("in fail")
        assert await lab.call(Add, "adder/add") == Add.Response(sum=1)
        assert (line(lab, "/adder/wrong").failed, accounts(lab)) == (1, True)


@virtual_time
async def test_an_async_handler_that_fails_answers_the_next_request():
    class Moody(Node):
        @service(Add, "add")
        async def add(self, request: Add.Request) -> Add.Response:
            await self.clock.sleep(0.1)
            return Add.Response(sum=1 // request.number)

    async with harness(Moody) as lab:
        calls = [lab.call(Add, "add", Add.Request(number=number)) for number in (0, 1)]
        failed, answered = await asyncio.gather(*calls, return_exceptions=True)
        assert (type(failed), answered) == (ServiceFailed, Add.Response(sum=1))


@virtual_time
async def test_a_handler_that_returns_no_response_has_failed():
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
        for name, told in {
            "nothing": "must return a test/srv/Add_Response, not None",
            "other": "must return a test/srv/Add_Response, not std_srvs/srv/Trigger_Response",
            "coroutine": "returned a coroutine, which nobody awaits",
        }.items():
            with pytest.raises(ServiceFailed, match=told):
                await lab.call(Add, name)


@virtual_time
async def test_an_error_that_the_caller_does_not_catch_is_its_own():
    class Careless(Node):
        wrong = client(Add, "adder/wrong")

        @timer(1.0)
        async def ask(self) -> None:
            await self.wrong.call()

    async with harness(Adder, Careless, expect_failure=Careless) as lab:
        await lab.advance(1)


@virtual_time
async def test_no_answer_in_time_is_a_timeout_of_virtual_time():
    async with harness(Adder) as lab:
        with pytest.raises(ServiceTimeout, match=r"/adder/never did not answer within 5 s \(its server is /adder\)"):
            await lab.call(Add, "adder/never")
        assert lab.clock.seconds() == 5
        with pytest.raises(TimeoutError):
            await lab.call(Add, "adder/never", timeout=0.25)
        assert lab.clock.seconds() == 5.25
        assert (line(lab, "/adder/never").withdrawn, line(lab, "/adder/never").waiting) == (1, 1)
        assert accounts(lab)


@virtual_time
async def test_a_caller_without_a_limit_waits_as_long_as_it_takes():
    async with harness(Adder) as lab:
        call = asyncio.create_task(lab.call(Add, "adder/never", timeout=None))
        await lab.advance(10_000)
        assert not call.done()
        call.cancel()


@pytest.mark.parametrize("limit_s", [0, -1, float("nan"), float("inf")])
@virtual_time
async def test_a_limit_in_which_nothing_can_happen_is_refused(limit_s):
    async with harness(Adder) as lab:
        with pytest.raises(ValueError, match="timeout is a number of seconds above 0, or None"):
            await lab.call(Add, "adder/add", timeout=limit_s)


@virtual_time
async def test_a_server_that_ends_tells_who_waits():
    async with harness(Adder, expect_failure=Adder) as lab:
        calls = [asyncio.create_task(lab.call(Add, "adder/slow", Add.Request(number=n))) for n in range(2)]
        await lab.settle()
        lab.fail(Adder, RuntimeError("planted"))
        for each in await asyncio.gather(*calls, return_exceptions=True):
            assert isinstance(each, ServiceGone)
            assert "/adder/slow: its server /adder ended before it had answered" in str(each)
        with pytest.raises(ServiceUnavailable, match="nobody answers /adder/slow any more: /adder has ended"):
            await lab.graph.bus.services["/adder/slow"].call(Add.Request(), caller="/test")
        assert (line(lab, "/adder/slow").lost, accounts(lab)) == (2, True)


@virtual_time
async def test_a_graph_that_stops_leaves_no_caller_waiting():
    async with harness(Adder) as lab:
        call = asyncio.create_task(lab.call(Add, "adder/never", timeout=None))
        await lab.settle()
    with pytest.raises(ServiceGone):
        await call
    with pytest.raises(NotRunning, match="has ended"):
        await lab.call(Add, "adder/add")
    assert accounts(lab)


@virtual_time
async def test_leaving_the_program_from_a_handler_fails_the_node():
    class Leaver(Node):
        @service(Trigger, "leave")
        async def leave(self, _request: Trigger.Request) -> Trigger.Response:
            raise SystemExit(3)

    async with harness(Leaver, expect_failure=Leaver) as lab:
        with pytest.raises(ServiceGone):
            await lab.call(Trigger, "leave")


@virtual_time
async def test_more_requests_than_there_is_room_for_are_refused_at_once():
    async with harness(Adder) as lab:
        calls = await three_calls(lab)
        with pytest.raises(ServiceUnavailable, match=r"/adder/slow of /adder has no room .* 2 wait already"):
            await lab.call(Add, "adder/slow")
        assert [each.sum for each in await asyncio.gather(*calls)] == [1, 2, 3]
        assert (line(lab, "/adder/slow").refused, accounts(lab)) == (1, True)


@virtual_time
async def test_a_caller_that_is_cancelled_withdraws_what_has_not_begun():
    async with harness(Adder) as lab:
        calls = await three_calls(lab)
        calls[0].cancel()
        calls[1].cancel()
        assert (await calls[2]).sum == 3
        assert lab.node(Adder).ended == [0, 2], "what had begun goes on, for nobody"
        assert all(each.cancelled() for each in calls[:2])
        told = line(lab, "/adder/slow")
        assert (told.served, told.withdrawn, accounts(lab)) == (2, 1, True)


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
async def test_the_limit_of_a_call_that_was_answered_leaves_nothing_behind():
    async with harness(Adder) as lab:
        await lab.call(Add, "adder/add", timeout=1000)
        assert [each for *_, each in asyncio.get_running_loop()._timers if not each.cancelled()] == []


@virtual_time
async def test_a_scope_of_anyio_ends_a_call_as_it_ends_any_wait():
    async with harness(Adder) as lab:
        with anyio.move_on_after(0.5) as scope:
            await lab.call(Add, "adder/never")
        assert (scope.cancelled_caught, lab.clock.seconds(), accounts(lab)) == (True, 0.5, True)


@virtual_time
async def test_a_request_of_another_type_is_refused_before_it_is_sent():
    async with harness(Adder) as lab:
        with pytest.raises(IncompatibleType, match="asks /adder/add with a test/srv/Add_Request, not std_srvs/srv/"):
            await lab.call(Add, "adder/add", SetBool.Request())
        with pytest.raises(IncompatibleType, match="/adder/add is a test/srv/Add, not a std_srvs/srv/Tri"):
            await lab.call(Trigger, "adder/add")
        with pytest.raises(IncompatibleType, match="uses the service /adder/slow as std_srvs/srv/Trigger, but it is"):
            await lab.call(Trigger, "adder/slow")
        assert line(lab, "/adder/add").received == 0


def test_a_call_from_another_thread_says_where_it_belongs():
    caught = []

    async def main():
        async with busflow.launch(Adder) as graph:
            found = graph.bus.services["/adder/add"]

            def ask():
                try:
                    asyncio.run(found.call(Add.Request(), caller="/thread"))
                except NotRunning as error:
                    caught.append(str(error))

            thread = threading.Thread(target=ask)
            thread.start()
            thread.join(60)

    asyncio.run(main())
    assert caught == ["a call of /adder/add must be awaited on the graph's own event loop"]


def test_a_graph_in_real_time_answers_too():
    async def main():
        async with busflow.launch(Adder) as graph:
            assert (await graph.call(Add, "adder/add", Add.Request(number=1))).sum == 2
            with pytest.raises(ServiceTimeout):
                await graph.call(Add, "adder/never", timeout=0.01)

    asyncio.run(main())


@virtual_time
async def test_a_server_that_is_made_anew_answers_again_and_its_node_has_one_account():
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
            with pytest.raises(ServiceUnavailable, match="nobody answers /phoenix/work any more: /phoenix has ended"):
                await lab.call(Trigger, "phoenix/work")
            lab.node(Phoenix).rise()
            assert (await lab.call(Trigger, "phoenix/work")).success
        told = line(lab, "/phoenix/work")
        assert (told.received, told.served, told.lost, accounts(lab)) == (6, 3, 3, True)


# Who waits for whom.


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
async def test_a_circle_of_callers_is_named_at_once(length):
    names = "abc"[:length]
    nodes = [Chain(f"{names[(at + 1) % length]}/step", name=each) for at, each in enumerate(names)]
    async with harness(*nodes) as lab:
        with pytest.raises(ServiceFailed) as caught:
            await lab.call(Trigger, "a/step")
        circle = ", which waits for ".join(f"/{each}/step" for each in (*names[1:], "a"))
        assert f"DeadlockError: /{names[-1]}/step waits for " in str(caught.value)
        told = str(caught.value).partition("DeadlockError: ")[2]
        steps = told.partition(": none of them")[0].replace(", which", "").split(" waits for ")
        assert sorted(set(steps)) == sorted(f"/{each}/step" for each in names)
        assert steps[0] == steps[-1], circle
        assert lab.clock.seconds() == 0
        assert accounts(lab)


@virtual_time
async def test_a_start_that_waits_for_a_service_of_its_own_node_is_a_deadlock():
    class Impatient(Node):
        own = client(Trigger, "~/ready")

        @service(Trigger, "~/ready")
        def ready(self, _request: Trigger.Request) -> Trigger.Response:
            return Trigger.Response(success=True)

        async def start(self) -> None:
            await self.own.call()

    with pytest.raises(NodeFailed, match=r"start\(\) of /impatient waits for /impatient/ready, which waits for start"):
        async with harness(Impatient):
            pass


@virtual_time
async def test_two_starts_that_wait_for_each_other_are_a_deadlock():
    class Starter(Node):
        def declare(self) -> None:
            self.create_service(Trigger, "~/ready", lambda _: Trigger.Response(success=True))
            self.other = self.create_client(Trigger, "right/ready" if self.name == "left" else "left/ready")

        async def start(self) -> None:
            await self.other.call()

    with pytest.raises(NodeFailed, match="DeadlockError"):
        async with harness(Starter(name="left"), Starter(name="right")) as lab:
            assert lab.clock.seconds() == 0


@virtual_time
async def test_what_a_handler_leaves_to_a_task_of_its_node_waits_for_nobody():
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
async def test_calls_side_by_side_are_on_behalf_of_the_handler():
    class Fork(Node):
        end = client(Trigger, "end")
        own = client(Trigger, "fork")

        @service(Trigger, "fork")
        async def fork(self, _request: Trigger.Request) -> Trigger.Response:
            ended, deadlock = await asyncio.gather(self.end.call(), self.own.call(), return_exceptions=True)
            return Trigger.Response(success=ended.success and isinstance(deadlock, DeadlockError))

    async with harness(Fork, End) as lab:
        assert (await lab.call(Trigger, "fork")).success


# Before the start.


def problems(*nodes, strict=False):
    graph = busflow.launch(*nodes, strict=strict)
    return [(problem.code, problem.severity.value, problem.message, problem.fix) for problem in graph.plan().problems]


class Asker(Node):
    ask = client(Add, "adder/ad")


def test_a_client_of_a_service_that_nobody_answers_is_warned_of():
    (found,) = problems(Adder, Asker)
    message = "Asker.ask of /asker calls /adder/ad, which nobody answers"
    assert found == ("nobody-answers", "warning", message, "did you mean '/adder/add'?")
    (found,) = problems(Adder, Asker, strict=True)
    assert found[1] == "error"


def test_two_servers_of_one_service_are_an_error():
    class Other(Node):
        @service(Add, "adder/add")
        def add(self, _request: Add.Request) -> Add.Response:
            return Add.Response()

    (found,) = problems(Adder, Other)
    assert found[:2] == ("two-servers", "error")
    assert found[2] == "Other.add of /other answers /adder/add, which Adder.add of /adder answers already"
    with pytest.raises(LaunchError):
        asyncio.run(busflow.launch(Adder, Other).start())


def test_two_types_of_one_service_are_an_error():
    class Wrong(Node):
        ask = client(Trigger, "adder/add")

    (found,) = problems(Adder, Wrong)
    assert found[0] == "type-mismatch"
    told = "Wrong.ask uses the service /adder/add as std_srvs/srv/Trigger, but Adder.add uses it as test/srv/Add"
    assert found[2] == told


@virtual_time
async def test_a_second_server_at_run_time_is_refused():
    class Second(Node):
        refused = ""

        async def run(self) -> None:
            try:
                self.create_service(Add, "adder/add", lambda _: Add.Response())
            except DuplicateServer as error:
                self.refused = str(error)

    async with harness(Adder, Second) as lab:
        await lab.settle()
        assert "cannot answer /adder/add, which /adder answers already" in lab.node(Second).refused
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
    (member,) = plan.members
    assert [each.service for each in (*member.servers, *member.clients)] == ["/left/one/reset", "/left/one/reset"]
    file.write_text(text.replace("plain:", "plane:"))
    found = [(problem.code, problem.fix) for problem in busflow.launch(file).plan().errors]
    assert found == [("unused-remap", "did you mean 'plain'?")]


# What others see of it.


@virtual_time
async def test_who_listens_on_the_bus_is_told_of_both_ends_as_they_come_and_go():
    came, went = [], []
    async with harness(Adder, Asker) as lab:
        lab.graph.bus.on_attach.append(came.append)
        lab.graph.bus.on_detach.append(went.append)
        await lab.call(Add, "adder/add")
        assert [each.service for each in came if isinstance(each, Client)] == ["/adder/add"]
    names = {(type(each).__name__, each.service) for each in went if isinstance(each, Server | Client)}
    assert {("Server", "/adder/add"), ("Client", "/adder/add"), ("Client", "/adder/ad")} <= names


class Elsewhere:
    """Stands for a server of another process."""

    node = "/elsewhere"
    holder = None

    def __init__(self):
        self.calls: list[Call] = []
        self.withdrawn: list[int] = []

    def accept(self, call):
        self.calls.append(call)

    def withdraw(self, call):
        self.withdrawn.append(call.number)

    def statistics(self):
        return None


@virtual_time
async def test_a_server_of_another_process_answers_as_one_of_this_would():
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
        with pytest.raises(ServiceFailed, match="it did not work"):
            await calls[1]
        with pytest.raises(ServiceTimeout, match="its server is /elsewhere"):
            await calls[2]
        with pytest.raises(ServiceFailed, match="ServiceTimeout"):
            await calls[3]
        assert set(there.withdrawn) == {2, 3, 4}
        away.leave(there)
        with pytest.raises(ServiceUnavailable):
            await lab.call(Trigger, "away")


@virtual_time
async def test_a_caller_of_another_process_is_served_as_one_of_this_would_be():
    async with harness(Adder) as lab:
        found = lab.graph.bus.services["/adder/add"]
        assert await found.call(Add.Request(number=1), caller="/elsewhere/asker") == Add.Response(sum=2)
        with pytest.raises(ServiceFailed):
            await lab.graph.bus.services["/adder/wrong"].call(Add.Request(), caller="/elsewhere/asker")
        assert accounts(lab)


# What is known to go wrong elsewhere.

CASES = {
    each["id"]: each for each in json.loads((Path(__file__).parents[1] / "cases/n_faults.json").read_text())["cases"]
}


def test_a_handler_that_raises_is_no_timeout_for_the_caller():
    case = CASES["node/raise-service"]
    assert case["expect"] == "caller gets an error with type and text (no secrets), not a timeout"

    async def main():
        async with busflow.launch(Adder) as graph:
            with pytest.raises(ServiceFailed) as caught:
                await graph.call(Add, "adder/wrong", timeout=60)
            return str(caught.value)

    assert asyncio.run(main()) == "/adder/wrong failed in /adder: ValueError: cannot add to 0"


@virtual_time
async def test_a_handler_may_make_and_call_services_but_not_wait_for_itself():
    case = CASES["node/reentrant"]
    assert case["expect"].endswith("a self call errors within its timeout")

    class Reentrant(Node):
        own = client(Trigger, "own")

        @service(Trigger, "own")
        async def answer(self, _request: Trigger.Request) -> Trigger.Response:
            self.create_service(Add, "made", lambda request: Add.Response(sum=request.number))
            made = await self.create_client(Add, "made").call(Add.Request(number=3))
            try:
                await self.own.call()
            except DeadlockError as error:
                return Trigger.Response(success=made.sum == 3, message=str(error))
            raise AssertionError

    async with harness(Reentrant) as lab:
        answer = await lab.call(Trigger, "own")
        assert answer.success
        assert answer.message.startswith("/own waits for /own: none of them could ever go on")
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
    assert all(each.done() for each in asked), "nobody is stuck"
    await asyncio.gather(*asked)
    return outcomes


@explore(schedules=200)  # a thousand take 20 s, and pass too
async def test_every_call_ends_in_one_answer_or_one_error_under_any_order():
    async with harness(Worker(name="left"), Worker(name="right"), expect_failure="right") as lab:
        outcomes = await storm(lab)
        assert len(outcomes) == 24
        assert {"answered", "ServiceFailed", "ServiceUnavailable"} <= set(outcomes)
        assert accounts(lab)
    assert all(server.waiting == 0 for each in lab.graph.report().services for server in each.servers)
    assert all(asking.waiting == 0 for each in lab.graph.report().services for asking in each.clients)
    assert accounts(lab)
