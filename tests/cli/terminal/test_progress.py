"""The progress bar shows how far the work is, and leaves nothing behind."""

import io
from contextlib import redirect_stderr, suppress

import pytest

from busflow.cli.terminal.progress import progress


class Terminal(io.StringIO):
    """A standard error that is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.fixture(autouse=True)
def environment(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "80")


def shown(messages, total=None, *, stream=None, after_half=lambda: None):
    """Return what is printed during work on this many messages."""
    printed = Terminal() if stream is None else stream
    with redirect_stderr(printed), progress("reading", total) as step:
        for number in range(messages):
            if number == messages // 2:
                after_half()
            step()
    return printed.getvalue()


def test_it_shows_the_count_and_the_time_left(monkeypatch):
    seconds = [100.0]
    monkeypatch.setattr("time.time", lambda: seconds[0])
    printed = shown(4000, lambda: 8000, after_half=lambda: seconds.append(seconds.pop() + 30))
    assert "reading  [#" in printed
    assert "4000/8000  00:00:30" in printed


def test_without_a_total_it_shows_the_count():
    printed = shown(4000)
    assert "reading  [" in printed
    assert "4000" in printed
    assert "/" not in printed


def test_short_work_shows_none():
    assert shown(1999, lambda: 1999) == ""


def test_ctrl_c_erases_the_bar_and_restores_cursor():
    printed = Terminal()

    def interrupted():
        raise KeyboardInterrupt

    with suppress(KeyboardInterrupt):
        shown(8000, lambda: 9000, stream=printed, after_half=interrupted)
    assert "4000/9000" in printed.getvalue()
    assert printed.getvalue().endswith("\x1b[?25h\n\x1b[A\x1b[2K")


def test_no_bar_without_a_terminal():
    assert shown(9000, lambda: 9000, stream=io.StringIO()) == ""


def test_no_bar_on_a_dumb_terminal(monkeypatch):
    monkeypatch.setenv("TERM", "dumb")
    assert shown(9000, lambda: 9000) == ""
