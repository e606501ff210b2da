"""The lines that a run keeps of its log become messages of `/rosout`, each once."""

from typing import Any

import pytest

from busflow.wire.client.client import join
from busflow_ui.foxglove.kept_log import kept_log


def test_each_kept_line_is_one_message(lab1: Any, monkeypatch: pytest.MonkeyPatch):
    lab1[0].look(monkeypatch)
    with join("lab1") as peer:
        type_ = peer.type("rcl_interfaces/msg/Log")
        lines = [line for answer in peer.ask("log", count=1000) for line in answer["lines"]]
        found = kept_log(peer, type_)
    messages = [type_.decode(payload) for payload in found]
    assert [each["msg"] for each in messages] == [line["text"] for line in lines]
    assert [each["name"] for each in messages] == [line["node"] for line in lines]
    assert list(found.values()) == [line["stamp_ns"] for line in lines]
    assert lines
