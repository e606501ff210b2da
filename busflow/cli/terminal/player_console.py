"""The console of a player: a progress bar, and the keys that pause, step and pace it."""

from __future__ import annotations

import os
import select
import shutil
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TextIO

from busflow.clock import NS_PER_S
from busflow.text import counted

if TYPE_CHECKING:
    from busflow.recording.player.playing import Playing

_LOOK_S = 0.1
_FASTER, _SLOWER = 1.1, 1 / 1.1
_CLEAR = "\r\x1b[2K"


class Controls(Protocol):
    """The state and controls of a player that a console uses, from a thread of its own."""

    def shown(self) -> PlayerState | None:
        """Return the player's state; None before it plays."""
        ...

    def toggle(self) -> None:
        """Pause or resume."""
        ...

    def step(self) -> None:
        """Play one message, while paused."""
        ...

    def pace(self, factor: float) -> None:
        """Play faster or slower."""
        ...


@dataclass(frozen=True, slots=True)
class PlayerState:
    """The state of a player at one moment."""

    position_ns: int
    """Nanoseconds since the start of the played span."""
    length_ns: int
    """The length of the played span."""
    rate: float
    paused: bool
    played: int
    """The number of messages published so far."""

    @classmethod
    def of(cls, playing: Playing) -> PlayerState:
        """Return the present state; may be called from any thread."""
        start, end = playing.span_ns
        return cls(
            playing.position_ns - start,
            max(0, end - start),
            playing.clock.rate,
            playing.clock.is_paused,
            playing.played,
        )


class Console:
    """A thread that draws the bar and reads keys; without a terminal there is none."""

    def __init__(self, controls: Controls, stream: TextIO | None = None) -> None:
        """Create the console of a player, on standard error by default."""
        self._controls, self._stream = controls, stream or sys.stderr
        self._end = threading.Event()
        self._thread: threading.Thread | None = None
        self._keys: dict[bytes, Callable[[], None]] = {
            b" ": controls.toggle,
            b"s": controls.step,
            b"\x1b[C": controls.step,
            b"\x1b[A": lambda: controls.pace(_FASTER),
            b"\x1b[B": lambda: controls.pace(_SLOWER),
        }

    def clear(self) -> None:
        """Erase the bar before a line of the log; it is drawn again below the line."""
        if self._thread is not None:
            self._stream.write(_CLEAR)

    @contextmanager
    def shown(self) -> Generator[None]:
        """Show the bar and read keys while the block lasts."""
        if not self._stream or not self._stream.isatty():
            yield
            return
        with _pressed_keys() as keyboard:
            self._thread = threading.Thread(target=self._work, args=(keyboard,), name="busflow.console", daemon=True)
            self._thread.start()
            try:
                yield
            finally:
                self._end.set()
                self._thread.join(timeout=1)
                self.clear()
                self._stream.flush()

    def press(self, keys: bytes) -> None:
        """Call the control of each key in turn; unknown keys are skipped."""
        while keys:
            known = next((each for each in self._keys if keys.startswith(each)), None)
            if known is not None:
                self._keys[known]()
            keys = keys[len(known or b"x") :]

    def line(self, width: int) -> str:
        """Return the bar, at most `width` characters wide; it is empty before the player begins."""
        now = self._controls.shown()
        if now is None:
            return ""
        total_s, done_s = now.length_ns / NS_PER_S, now.position_ns / NS_PER_S
        state = "paused" if now.paused else f"x{now.rate:g}"
        text = f" {done_s:.1f} / {total_s:.1f} s  {counted(now.played, 'message')}  {state}"
        room = max(0, min(40, width - len(text) - 3))
        full = room if not total_s else min(room, int(room * done_s / total_s))
        return f"[{'#' * full}{'.' * (room - full)}]{text}"[: max(0, width - 1)]

    def _work(self, keyboard: int | None) -> None:
        while not self._end.is_set():
            if keyboard is None:
                self._end.wait(_LOOK_S)
            elif select.select([keyboard], [], [], _LOOK_S)[0]:
                keys = os.read(keyboard, 64)
                keyboard = keyboard if keys else None
                self.press(keys)
            self._stream.write(_CLEAR + self.line(shutil.get_terminal_size().columns))
            self._stream.flush()


@contextmanager
def _pressed_keys() -> Generator[int | None]:
    """Yield the keyboard's file descriptor, set to deliver each key at once; None without a keyboard."""
    if not sys.stdin or not sys.stdin.isatty():
        yield None
        return
    try:
        import termios
        import tty
    except ImportError:  # not on Windows
        yield None
        return
    keyboard = sys.stdin.fileno()
    before = termios.tcgetattr(keyboard)
    try:
        tty.setcbreak(keyboard)
        yield keyboard
    finally:
        termios.tcsetattr(keyboard, termios.TCSADRAIN, before)
