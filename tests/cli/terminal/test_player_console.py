"""The console of a player: its keys and its bar."""

import asyncio
import io
import os
import pty
import termios
import threading
from types import SimpleNamespace

from busflow.cli.bag.play_alone import _GraphControls
from busflow.cli.bag.play_into import _LoopControls
from busflow.cli.terminal.player_console import Console, PlayerState
from busflow.clock import SystemClock
from busflow.recording.player.player import Player
from busflow.recording.player.playing import Playing
from busflow.runner.graph import Graph


class Controls:
    """Controls that note what a console asks of them, in order."""

    def __init__(self, state=None):
        self.state, self.asked, self.stepped = state, [], threading.Event()

    def shown(self):
        return self.state

    def toggle(self):
        self.asked.append("toggle")

    def step(self):
        self.asked.append("step")
        self.stepped.set()

    def pace(self, factor):
        self.asked.append(round(factor, 3))


def test_keys_are_those_of_ros_2():
    controls = Controls()
    Console(controls).press(b" s\x1b[C\x1b[A\x1b[Bqq \x1b[Z ")
    assert controls.asked == ["toggle", "step", "step", 1.1, 0.909, "toggle", "toggle"]


def test_bar_shows_the_position():
    console = Console(Controls(PlayerState(2_500_000_000, 10_000_000_000, 2.0, False, 42)))
    assert console.line(100) == "[##########..............................] 2.5 / 10.0 s  42 messages  x2"
    assert len(console.line(30)) < 30
    console = Console(Controls(PlayerState(0, 0, 1.0, True, 0)))
    assert console.line(80).endswith("0.0 / 0.0 s  0 messages  paused")
    assert Console(Controls()).line(80) == ""


def test_idle_player_has_no_bar_and_ignores_keys(tmp_path):
    player = Player(file=tmp_path / "run.mcap")
    console = Console(_GraphControls(Graph([player]), player))
    assert console.line(80) == ""
    console.press(b" s\x1b[A")
    assert (player.parameters.paused, player.parameters.rate) == (False, 1.0)


def test_keys_are_ignored_once_the_loop_of_a_played_recording_is_closed():
    loop = asyncio.new_event_loop()
    span = SimpleNamespace(start_ns=0, end_ns=1)

    async def publish(_entry):
        raise AssertionError("nothing is played")

    playing = Playing(span, SystemClock(), publish)
    console = Console(_LoopControls(loop, playing))
    loop.close()
    console.press(b" s\x1b[A")
    assert (playing.clock.is_paused, playing.clock.rate, playing.played) == (False, 1.0, 0)


class Terminal(io.StringIO):
    """What a terminal shows."""

    def isatty(self):
        return True


def test_keys_reach_player_without_enter(monkeypatch):
    person, keyboard = pty.openpty()
    before = termios.tcgetattr(keyboard)
    controls, screen = Controls(PlayerState(0, 10_000_000_000, 1.0, True, 0)), Terminal()
    with os.fdopen(keyboard) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        console = Console(controls, screen)
        with console.shown():
            os.write(person, b" s")
            assert controls.stepped.wait(60)
        assert termios.tcgetattr(keyboard) == before
    os.close(person)
    assert controls.asked == ["toggle", "step"]
    assert "0.0 / 10.0 s  0 messages  paused" in screen.getvalue()
    assert screen.getvalue().endswith("\r\x1b[2K")


def test_console_needs_a_terminal():
    screen = io.StringIO()
    with Console(Controls(PlayerState(0, 0, 1.0, False, 0)), screen).shown():
        pass
    assert screen.getvalue() == ""
