"""The screen of `busflow top` on a running graph, driven by keys, and the command in a terminal."""

import asyncio
import os
import pty
import select
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest
from textual.pilot import Pilot
from textual.widgets import DataTable, Input, RichLog, Static

from busflow.cli.top.screen import Top
from busflow.wire.client.client import join
from tests.cli.conftest import LABS, Shell

PATIENCE_S = 60.0


def rows(app: Top, name: str) -> dict[str, list[str]]:
    table: DataTable[Any] = app.query_one(f"#{name}", DataTable)
    return {str(key.value): [str(cell) for cell in table.get_row(key)] for key in table.rows}


def text(app: Top, name: str) -> str:
    return str(app.query_one(f"#{name}", Static).render())


async def until(pilot: Pilot[None], holds: Callable[[], bool]) -> None:
    """Run the screen until a condition holds."""
    async with asyncio.timeout(PATIENCE_S):
        while not holds():
            await pilot.pause(0.02)


def driven(play: Callable[[Top, Pilot[None]], Any], size: tuple[int, int] = (160, 50)) -> None:
    """Run the screen on the running lab, and press keys."""

    async def go() -> None:
        with join() as peer:
            app = Top(peer, 0.1)
            async with app.run_test(size=size) as pilot:
                await until(pilot, lambda: bool(rows(app, "topics")))
                await play(app, pilot)

    asyncio.run(go())


@pytest.mark.usefixtures("lab")
def test_nodes_topics_and_rates_are_shown():
    async def play(app: Top, pilot: Pilot[None]) -> None:
        await until(pilot, lambda: rows(app, "topics")["/imu/data"][2] not in ("", "0.0"))
        name, type_, rate, published, ends, dropped, queued = rows(app, "topics")["/imu/data"]
        assert (name, type_, ends, dropped, queued) == ("/imu/data", "sensor_msgs/msg/Imu", "1 → 1", "0", "0")
        assert float(rate) > 0
        assert int(published) > 0
        assert rows(app, "nodes")["/imu_publisher"][1:3] == ["running", "imu_publisher"]
        assert "imu_lab" in text(app, "head")

    driven(play)


@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize("size", [(80, 24), (60, 24), (40, 20)], ids="{0[0]}x{0[1]}".format)
def test_small_terminal_shows_all_figures(size: tuple[int, int]):
    async def play(app: Top, pilot: Pilot[None]) -> None:
        await until(pilot, lambda: bool(app.query_one("#log", RichLog).lines))
        for name, figures in (("topics", {"Hz", "dropped", "queued"}), ("nodes", {"state", "dropped"})):
            table: DataTable[Any] = app.query_one(f"#{name}", DataTable)
            await until(pilot, lambda table=table: 0 < table.virtual_size.width <= table.size.width)
            assert figures <= {str(column.value) for column in table.columns}
            assert table.size.width == size[0]
        await until(pilot, lambda: app.query_one("#topics").size.height == 1 + len(rows(app, "topics")))
        await until(pilot, lambda: app.query_one("#log").size.height <= len(app.query_one("#log", RichLog).lines))
        assert not app.query_one("#detail").display

    driven(play, size)


@pytest.mark.usefixtures("lab")
def test_tables_follow_size_and_keep_the_selection():
    def titles(app: Top) -> list[str]:
        return [str(column.value) for column in app.query_one("#topics", DataTable).columns]

    async def play(app: Top, pilot: Pilot[None]) -> None:
        table: DataTable[Any] = app.query_one("#topics", DataTable)
        await until(pilot, lambda: "type" in titles(app) and table.row_count > 2)
        table.move_cursor(row=2)
        await pilot.resize_terminal(40, 24)
        await until(pilot, lambda: "type" not in titles(app))
        assert table.cursor_row == 2
        await pilot.press("e")
        await until(pilot, lambda: app.query_one("#detail").size.width >= 36)
        await pilot.press("e")
        await until(pilot, lambda: not app.query_one("#detail").display)

    driven(play)


@pytest.mark.long
@pytest.mark.usefixtures("lab")
def test_chosen_topic_is_echoed_and_plotted():
    async def play(app: Top, pilot: Pilot[None]) -> None:
        table: DataTable[Any] = app.query_one("#topics", DataTable)
        table.move_cursor(row=table.get_row_index("/imu/data"))
        await pilot.press("e")
        await until(pilot, lambda: "linear_acceleration:" in text(app, "message"))
        await until(pilot, lambda: "orientation.x = " in text(app, "message"))
        await plot(app, pilot, "header.stamp.sec")
        await until(pilot, lambda: "header.stamp.sec = " in text(app, "message"))
        await plot(app, pilot, "nothing")
        await until(pilot, lambda: "there is no number nothing" in text(app, "message"))

    driven(play)


async def plot(app: Top, pilot: Pilot[None], field: str) -> None:
    """Enter the field to plot, in one step: Textual waits a second after each key while messages arrive."""
    await pilot.press("p")
    app.query_one(Input).value = field
    await pilot.press("enter")


@pytest.mark.usefixtures("lab")
def test_a_pause_keeps_the_picture_and_goes_on():
    async def play(app: Top, pilot: Pilot[None]) -> None:
        await pilot.press("space")
        await until(pilot, lambda: "paused" in text(app, "head"))
        await pilot.press("space")
        await until(pilot, lambda: "every 0.1 s" in text(app, "head"))

    driven(play)


def test_goals_are_shown_at_both_ends(stand: Callable[..., Any], monkeypatch: pytest.MonkeyPatch):
    place, run = stand(LABS / "goals.yaml")
    run.wait_for("works")
    place.look(monkeypatch)

    async def play(app: Top, pilot: Pilot[None]) -> None:
        ends = [f"/arm/count {arrow} /arm" for arrow in "←→"]
        await until(pilot, lambda: [*rows(app, "actions")] == ends)
        table: DataTable[Any] = app.query_one("#actions", DataTable)
        titles = [str(column.value) for column in table.columns]
        await until(pilot, lambda: all(rows(app, "actions")[end][titles.index("running")] == "1" for end in ends))
        assert {rows(app, "actions")[end][titles.index("succeeded")] for end in ends} == {"1"}
        await until(pilot, lambda: table.size.height == 3)

    driven(play)


@pytest.mark.usefixtures("lab")
def test_run_without_actions_has_no_table_of_them():
    async def play(app: Top, _pilot: Pilot[None]) -> None:
        assert not app.query_one("#actions", DataTable).display

    driven(play)


@pytest.mark.usefixtures("lab")
def test_the_log_is_shown():
    async def play(app: Top, pilot: Pilot[None]) -> None:
        await until(pilot, lambda: any("works" in line.text for line in app.query_one("#log", RichLog).lines))

    driven(play)


@pytest.mark.usefixtures("lab")
def test_snapshot_during_closing_is_not_shown():
    async def go() -> None:
        with join() as peer:
            app = Top(peer, 0.1)
            async with app.run_test() as pilot:
                await until(pilot, lambda: bool(rows(app, "topics")))
                before = app._close_all

                async def close_all() -> None:
                    await before()  # the widgets are gone
                    app._leaving.clear()
                    try:
                        await asyncio.to_thread(app._hand, app._show_head, "late")
                    finally:
                        app._leaving.set()

                app._close_all = close_all

    asyncio.run(go())


@pytest.mark.usefixtures("place")
def test_missing_terminal_or_run_is_reported(shell: Shell):
    assert shell("top") == 2


@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize(("key", "code"), [(b"q", 0), (b"\x03", 130)])
def test_q_and_ctrl_c_end_it(key: bytes, code: int):
    screen, terminal = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "120", "LINES": "40"}
    command = [sys.executable, "-m", "busflow", "top", "--interval", "0.1"]
    with subprocess.Popen(command, stdin=terminal, stdout=terminal, stderr=terminal, env=environment) as top:
        os.close(terminal)
        shown = b""
        while b"/imu/data" not in shown:
            ready, _, _ = select.select([screen], [], [], PATIENCE_S)
            assert ready, shown
            shown += os.read(screen, 65536)
        os.write(screen, key)
        with suppress(OSError):  # how Linux reports a closed terminal
            while os.read(screen, 65536):
                pass
        assert top.wait(PATIENCE_S) == code
        os.close(screen)
