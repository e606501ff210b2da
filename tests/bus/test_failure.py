"""Tests of `failure.py`: the text of a failure, and what counts as one."""

from __future__ import annotations

import asyncio

import pytest

from busflow.bus.failure import Failure, is_failure, refuse_coroutine
from busflow.errors import InvalidDeclaration
from busflow.msgs.std_msgs import Int64


def fail():
    raise ValueError("wrong\nvalue")


def raised():
    with pytest.raises(ValueError, match="wrong") as caught:
        fail()
    return caught.value


def test_text_names_node_handler_line_and_message(golden):
    failure = Failure("/arm", "Arm.on_number (subscription /n)", raised(), Int64(data=3))
    golden(failure.render())


def test_cause_of_a_group_is_its_first_exception(golden):
    error = raised()
    group = ExceptionGroup("tasks", [ExceptionGroup("inner", [error]), OSError()])
    failure = Failure("/arm", "Arm.start", group)
    assert failure.cause is error
    golden(failure.summary)


def test_cancellation_from_outside_is_no_failure():
    async def main():
        found = []

        async def handler():
            try:
                await asyncio.sleep(60)
            except asyncio.CancelledError as error:
                found.append(is_failure(error))
                raise

        task = asyncio.create_task(handler())
        await asyncio.sleep(0)
        task.cancel()
        await asyncio.wait([task])
        return [*found, is_failure(asyncio.CancelledError()), is_failure(ValueError())]

    assert asyncio.run(main()) == [False, True, True]


def test_generator_exit_fails_only_a_running_task():
    async def judged() -> list[bool]:
        loop, seen = asyncio.get_running_loop(), list[bool]()
        loop.call_soon(lambda: seen.append(is_failure(GeneratorExit())))
        await asyncio.sleep(0)
        return [*seen, is_failure(GeneratorExit())]

    assert not is_failure(GeneratorExit())
    assert asyncio.run(judged()) == [False, True]


def test_coroutine_and_generator_results_are_refused(golden):
    async def coroutine():
        raise AssertionError

    def generator():
        yield

    with golden.raises(InvalidDeclaration):
        refuse_coroutine(coroutine(), "Arm.on_n")
    with golden.raises(InvalidDeclaration):
        refuse_coroutine(generator(), "Arm.on_n")
    refuse_coroutine(None, "Arm.on_n")


@pytest.mark.filterwarnings("error")
def test_forgotten_await_is_named_and_warned_of_once(golden):
    async def call():
        raise AssertionError

    with pytest.raises(AttributeError) as caught:
        call().success  # noqa: B018  # what a user writes who forgets to await
    golden(Failure("/a", "A.tick (timer)", caught.value).render())
