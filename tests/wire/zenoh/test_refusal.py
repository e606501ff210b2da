"""Errors of another process are raised here as the same class, as far as a run may raise it."""

import json

import pytest

from busflow.errors import BusflowError, NoSuchTarget, ServiceFailed, ServiceGone, ServiceUnavailable
from busflow.wire.zenoh.refusal import encode_refusal, refusal, service_refusal


def test_a_service_error_keeps_its_class_and_text():
    error = service_refusal("/lamp/switch", "/lamp", encode_refusal(ServiceUnavailable("no such server")))
    assert (type(error), str(error)) == (ServiceUnavailable, "no such server")


def test_another_error_of_a_server_becomes_service_failed():
    assert type(service_refusal("/lamp/switch", "/lamp", encode_refusal(KeyError("x")))) is ServiceFailed


@pytest.mark.parametrize("reply", [b"", b"[]", b"{}", b"\xff", b'{"kind": "ServiceFailed"}'])
def test_an_unreadable_reply_means_the_server_is_gone(reply: bytes):
    error = service_refusal("/lamp/switch", "/lamp", reply)
    assert (type(error), str(error)) == (ServiceGone, "/lamp/switch: /lamp did not answer")


@pytest.mark.parametrize("kind", ["SystemExit", "ServiceGone", "__name__", "annotations"])
def test_a_query_raises_no_class_of_choice(kind: str):
    assert type(refusal(kind, "text")) is BusflowError
    assert type(refusal("NoSuchTarget", "text")) is NoSuchTarget
    assert json.loads(encode_refusal(NoSuchTarget("text"))) == {"kind": "NoSuchTarget", "error": "text"}
