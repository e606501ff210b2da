"""Limits of real time of `busflow ui`: a variable sets them."""

from collections.abc import Callable
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from busflow_ui.page_server.server import WRONG_TOKEN
from busflow_ui.timeouts import VARIABLE
from ui.tests.page_server.conftest import built_page, show

__all__ = ["built_page", "show"]


def test_page_that_sends_no_token_is_refused_at_the_limit(show: Callable[..., Any], lab1: Any):
    shown = show(environment={**lab1[0].environment, VARIABLE: "hello=0"})
    address = f"{shown.url.replace('http', 'ws')}/ws"
    with (
        connect(address, subprotocols=["foxglove.sdk.v1"]) as socket,  # type: ignore[list-item]  # text will do
        pytest.raises(ConnectionClosed) as refused,
    ):
        socket.recv()
    assert refused.value.rcvd is not None
    assert refused.value.rcvd.code == WRONG_TOKEN


def test_limit_that_is_unknown_is_refused(show: Callable[..., Any], place: Any):
    with pytest.raises(AssertionError) as refused:
        show(environment={**place.environment, VARIABLE: "helo=0"})
    ((printed, warned),) = refused.value.args
    assert (printed, VARIABLE in warned) == ("", True)
