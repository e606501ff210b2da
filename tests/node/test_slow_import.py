"""The import of a plugin that takes long is named with its line, and ends where a limit is stated."""

import io
import sys
import threading

import pytest

from busflow.errors import InvalidInput
from busflow.node import plugins, slow_import

PLUGIN = """import sys
sys.modules["gate"].wait(60)

from busflow import Node


class Camera(Node):
    pass
"""
LINE = 'camera.py:2: sys.modules["gate"].wait(60)'


class Gate(threading.Event):
    """What the import waits for."""

    def __init__(self):
        super().__init__()
        self.reached = threading.Event()

    def wait(self, timeout=None):
        self.reached.set()
        return super().wait(timeout)


class Stream(io.StringIO):
    """Standard error, which lets the import go on once a text stands there."""

    awaited = ""

    def flush(self):
        if self.awaited in self.getvalue():
            sys.modules["gate"].set()


@pytest.fixture
def imported(tmp_path, monkeypatch, limits):
    """What standard error says and which exit codes there were, while a plugin is imported."""

    def imported(awaited, limit=None):
        (tmp_path / "camera.py").write_text(PLUGIN)
        stream, codes, gate = Stream(), [], Gate()
        stream.awaited = awaited

        def watch_from_the_line_on(*arguments):
            gate.reached.wait(60)  # on a busy machine the import may come there later than the limit
            watch(*arguments)

        watch = slow_import._watch
        monkeypatch.setattr(slow_import, "_watch", watch_from_the_line_on)
        monkeypatch.setitem(sys.modules, "gate", gate)
        monkeypatch.setattr(sys, "stderr", stream)
        limits(import_warning=0.2)
        monkeypatch.setattr(slow_import.os, "_exit", codes.append)
        if limit is not None:
            monkeypatch.setenv("BUSFLOW_IMPORT_LIMIT", limit)
        before = set(threading.enumerate())
        assert plugins.load("camera", [tmp_path]).__name__ == "Camera"
        for thread in set(threading.enumerate()) - before:
            thread.join(60)
        return stream.getvalue(), codes

    return imported


@pytest.mark.parametrize("limit", [None, "1h"])
def test_a_slow_import_is_named_with_line(imported, limit):
    text, codes = imported("warning", limit)
    assert text.startswith("warning: after 0.2 s plugin 'camera' ")
    assert LINE in text
    assert not codes


@pytest.mark.parametrize(("limit", "warnings"), [("150ms", 0), ("300ms", 1)])
def test_an_import_ends_at_its_limit(imported, limit, warnings):
    text, codes = imported("error", limit)
    assert "error: plugin 'camera' " in text
    assert (text.count("warning: "), text.count(LINE), codes) == (warnings, 1 + warnings, [2])


def test_a_bad_import_limit_is_refused(tmp_path, monkeypatch, golden):
    (tmp_path / "camera.py").write_text("raise AssertionError('imported')")
    monkeypatch.setenv("BUSFLOW_IMPORT_LIMIT", "never")
    with golden.raises(InvalidInput) as caught:
        plugins.load("camera", [tmp_path])
    assert caught.value.code == "import-limit"


def test_the_library_is_named_without_own_line(tmp_path):
    ended, begun = threading.Event(), threading.Event()

    def wait():
        begun.set()
        ended.wait(60)

    thread = threading.Thread(target=wait)
    thread.start()
    begun.wait(60)
    try:
        assert slow_import._place(tmp_path, thread.ident)
    finally:
        ended.set()
        thread.join(60)
