"""What to write in place of a name that Python has not found."""

import asyncio
import importlib
from collections.abc import Callable

import pytest

from busflow.msgs import sensor_msgs
from busflow.validation.advice import advice, close_unawaited


def raised(code: Callable[[], object]) -> BaseException:
    with pytest.raises(BaseException) as info:  # noqa: PT011  # any exception will do
        code()
    return info.value


class Hostile:
    def __dir__(self):
        raise RuntimeError


@pytest.mark.parametrize(
    ("code", "meant"),
    [
        (lambda: sensor_msgs.Imu().linear_accelaration, "linear_acceleration"),  # type: ignore[attr-defined]  # the case
        (lambda: sensor_msg, "sensor_msgs"),  # type: ignore[name-defined]  # noqa: F821  # the case
        (lambda: importlib.import_module("busflow.msgs.sensr_msgs"), "sensor_msgs"),
        (lambda: exec("from busflow import Nod"), "Node"),  # noqa: S102  # the case
        (lambda: importlib.import_module("nmpy"), None),
        (lambda: Hostile().publish, None),  # type: ignore[attr-defined]  # the case
        (lambda: 1 / 0, None),
    ],
)
def test_advice_names_the_nearest_that_is_there(code, meant):
    assert advice(raised(code)) == (meant and f"did you mean {meant!r}?")


def test_a_name_of_rclpys_client_is_translated():
    error = raised(lambda: Hostile().call_async)  # type: ignore[attr-defined]  # the case
    assert advice(error) == "write await client.call(request)"


def test_text_of_its_own_is_left_alone():
    """A node's error for a name of rclpy says already what to write."""
    assert advice(AttributeError("Arm has no get_name_", name="get_name", obj=raised)) is None


def test_second_event_loop_has_advice_without_warning(golden):
    async def work():
        raise AssertionError

    async def handler():
        error = raised(lambda: asyncio.run(work()))
        close_unawaited(error)  # else pytest fails a coroutine that nothing has awaited
        return advice(error)

    golden(asyncio.run(handler()))
