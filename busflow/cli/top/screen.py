"""The screen of `busflow top`: lays out and updates what `picture` computes.

A thread of its own asks the run, so that keys work while the run does not answer.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, ClassVar, cast

from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import DataTable, Footer, Input, RichLog, Sparkline, Static
from textual.widgets.data_table import RowDoesNotExist

from busflow.cli.terminal.output import short_path
from busflow.cli.terminal.table import Column, narrowed
from busflow.cli.top.picture import (
    ACTION_COLUMNS,
    NODE_COLUMNS,
    TOPIC_COLUMNS,
    Look,
    action_rows,
    first_plotted,
    lines,
    node_rows,
    numbers,
    topic_rows,
)
from busflow.clock import perf_counter
from busflow.errors import BusflowError, ExitCode
from busflow.text import printable
from busflow.wire.client.client import Listener, Peer
from busflow.wire.client.graph_view import TopicView

_RATED_S = 3.0
"""The time over which rates are computed; the last interval where that is longer."""
_PLOTTED = 200
_LOGGED = 200
_ECHO_S = 0.1
"""The shortest time between two shown messages, as a person can read."""
_LEVELS = {50: "bold red", 40: "red", 30: "yellow"}
_STATES = {"failed": "bold red", "restarting": "yellow", "stopped": "dim", "stopped by hand": "yellow"}


class Top(App[None]):
    """The app that shows a running graph live."""

    TITLE: str | None = "busflow top"
    CSS: ClassVar[str] = """
    DataTable { height: auto; scrollbar-size-vertical: 1; }
    #body { height: 1fr; }
    #topics { max-height: 65%; }
    #actions { display: none; max-height: 25%; }
    #nodes { height: 1fr; }
    #detail { display: none; width: 40%; border-left: solid $accent; padding: 0 1; }
    #log { height: auto; min-height: 2; max-height: 30vh; border-top: solid $accent; scrollbar-size-vertical: 1; }
    #plot { height: 4; }
    #field { display: none; }
    #head { height: 1; background: $accent; color: $text; }
    .-echoes #detail { display: block; }
    .-narrow #body { layout: vertical; }
    .-narrow #detail { width: 100%; border-left: none; border-top: solid $accent; }
    .-narrow.-echoes #nodes { display: none; }
    .-narrow.-echoes #tables { height: auto; }
    .-narrow.-echoes #topics { max-height: 25vh; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        ("e", "echo", "Echo"),
        ("p", "plot", "Plot a number"),
        ("space", "pause", "Pause"),
        ("q", "quit", "Quit"),
        Binding("ctrl+c", "interrupt", "Quit", show=False, priority=True),
    ]

    def __init__(self, peer: Peer, interval_s: float) -> None:
        super().__init__()
        self.HORIZONTAL_BREAKPOINTS: list[tuple[int, str]] | None = [(0, "-narrow"), (110, "-wide")]
        self._peer, self._interval_s = peer, interval_s
        self._looks: deque[Look] = deque()
        self._paused = False
        self._leaving = threading.Event()
        self._echoed: str | None = None
        self._field: str | None = None
        self._numbers: deque[float] = deque(maxlen=_PLOTTED)
        self._last_log_ns = 0

    def compose(self) -> ComposeResult:
        """Yield the widgets: the tables, the details of the echoed topic beside or below them, and the log."""
        yield Static("", id="head")
        with Horizontal(id="body"):
            with Vertical(id="tables"):
                yield DataTable[str](id="topics", cursor_type="row", zebra_stripes=True)
                yield DataTable[str](id="actions", cursor_type="row")
                yield DataTable[str](id="nodes", cursor_type="row")
            with Vertical(id="detail"):
                yield Static("", id="message")
                yield Input(placeholder="which number, e.g. linear_acceleration.z", id="field")
                yield Sparkline([], id="plot")
        yield RichLog(id="log", max_lines=_LOGGED, wrap=True)
        yield Footer()

    def on_mount(self) -> None:
        """Focus the tables and start the thread that asks the run."""
        self._table("topics").focus()
        self.run_worker(self._look_again_and_again, thread=True, exit_on_error=True)

    def on_unmount(self) -> None:
        """End the threads."""
        self._leaving.set()

    # In the thread that asks the run.

    def _look_again_and_again(self) -> None:
        while not self._leaving.is_set():
            if not self._paused:
                try:
                    look = Look(self._peer.graph(), perf_counter())
                    run = self._peer.ask("run")[0]
                    self._hand(self._show, look, run, self._log_lines())
                except BusflowError as error:
                    self._hand(self._show_head, f"{self._peer.run.name}: {error}")
            self._leaving.wait(self._interval_s)

    def _log_lines(self) -> list[dict[str, Any]]:
        """Return the lines logged since the last snapshot, the oldest first."""
        found = [line for answer in self._peer.ask("log", count=_LOGGED) for line in answer["lines"]]
        found.sort(key=lambda each: each["stamp_ns"])
        new = [each for each in found if each["stamp_ns"] > self._last_log_ns]
        if new:
            self._last_log_ns = new[-1]["stamp_ns"]
        return new

    def _hand(self, show: Any, *arguments: Any) -> None:
        if not self._leaving.is_set():
            self.call_from_thread(self._unless_closing, show, *arguments)

    # On the screen.

    def _unless_closing(self, show: Any, *arguments: Any) -> None:
        """Call a function, unless the screen is closing: its widgets are removed before the threads end."""
        if self.is_running:
            show(*arguments)

    def _show(self, look: Look, run: dict[str, Any], log_lines: list[dict[str, Any]]) -> None:
        while len(self._looks) > 1 and look.at_s - self._looks[1].at_s >= _RATED_S:
            self._looks.popleft()
        self._looks.append(look)
        state = "paused" if self._paused else f"every {self._interval_s:g} s"
        text = f"up {run['elapsed_s']:.0f} s  ({state})  pid {run['pid']}"
        self._show_head(f"{run['name']}  {text}  {short_path(run['file'] or '')}")
        self._fill_tables()
        log = self.query_one("#log", RichLog)
        for line in log_lines:
            style = next((style for level, style in _LEVELS.items() if line["level"] >= level), "")
            log.write(Text(printable(f"{line['node']}: {line['text']}"), style))

    def on_resize(self) -> None:
        """Lay out the tables again for the new size."""
        self.call_after_refresh(self._fill_tables)

    def _fill_tables(self) -> None:
        if self._looks:
            now = self._looks[-1]
            self._fill("topics", TOPIC_COLUMNS, [row.cells() for row in topic_rows(now, self._looks[0])])
            self._fill("nodes", NODE_COLUMNS, [row.cells() for row in node_rows(now)])
            actions = action_rows(now)
            self._table("actions").display = bool(actions)
            self._fill("actions", ACTION_COLUMNS, actions)

    def _fill(self, name: str, columns: Sequence[Column], rows: list[tuple[str, ...]]) -> None:
        """Update a table row by row, so that the cursor stays where it is."""
        table = self._table(name)
        room = table.scrollable_content_region.width or self.size.width
        left, shown = narrowed(rows, columns, room, gap=2 * table.cell_padding)
        titles, keys = [column.title for column in left], [row[0] for row in rows]
        chosen = table.cursor_row
        if changed := titles != [str(column.value) for column in table.columns]:
            table.clear(columns=True)
            for title in titles:
                table.add_column(title, key=title)
        for key in [each.value for each in table.rows if each.value not in keys]:
            table.remove_row(str(key))
        for key, row in zip(keys, shown, strict=True):
            cells = [Text(cell, _style(name, title, cell)) for title, cell in zip(titles, row, strict=True)]
            try:
                table.get_row_index(key)
            except RowDoesNotExist:
                table.add_row(*cells, key=key)
            else:
                for title, cell in zip(titles, cells, strict=True):
                    table.update_cell(key, title, cell, update_width=True)
        if changed:
            table.move_cursor(row=chosen)

    def _show_head(self, text: str) -> None:
        self.query_one("#head", Static).update(Text(printable(text)))

    def _table(self, name: str) -> DataTable[Any]:
        return cast("DataTable[Any]", self.query_one(f"#{name}"))

    def _chosen(self) -> TopicView | None:
        table = self._table("topics")
        if not self._looks or not table.row_count:
            return None
        key = table.coordinate_to_cell_key(table.cursor_coordinate).row_key.value
        return self._looks[-1].graph.topics.get(str(key))

    # Keys.

    def action_interrupt(self) -> None:
        """End with the exit code of Ctrl-C."""
        self.exit(return_code=ExitCode.INTERRUPTED)

    def action_pause(self) -> None:
        """Pause or resume the updates."""
        self._paused = not self._paused
        if self._paused:
            self._show_head("paused; space resumes")

    def action_echo(self) -> None:
        """Show the messages of the chosen topic, or stop showing them."""
        topic = self._chosen()
        if topic is None or self._echoed == topic.name:
            self._echoed = None
            self.screen.remove_class("-echoes")
            return
        self.screen.add_class("-echoes")
        self._echoed, self._field = topic.name, None
        self._numbers.clear()
        self.query_one("#plot", Sparkline).data = []
        self.query_one("#message", Static).update(Text(f"{topic.name}\n\nwaiting for a message"))
        self.run_worker(partial(self._echo, topic), thread=True, exit_on_error=False)

    def action_plot(self) -> None:
        """Ask for the number of the chosen topic to plot."""
        topic = self._chosen()
        if topic is None:
            return
        if self._echoed != topic.name:
            self.action_echo()
        field = self.query_one("#field", Input)
        field.display = True
        field.focus()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Plot the number that was entered."""
        self._field = event.value.strip() or None
        self._numbers.clear()
        event.input.display = False
        self._table("topics").focus()

    # In the thread that receives messages.

    def _echo(self, topic: TopicView) -> None:
        try:
            decode = self._peer.type(topic.types[0]).decode
            with self._peer.listen(topic, depth=_PLOTTED) as listener:
                for values in self._messages(topic, listener, decode):
                    self._hand(self._show_message, topic.name, values)
        except BusflowError as error:
            self._hand(self.query_one("#message", Static).update, Text(printable(error)))

    def _messages(self, topic: TopicView, listener: Listener, decode: Any) -> Iterator[list[Any]]:
        """Yield the messages that arrive while the topic is echoed, in bursts."""
        while self._echoed == topic.name and not self._leaving.is_set():
            first = listener.get(self._interval_s)
            if first is not None:
                burst = [first]
                while len(burst) < _PLOTTED and (more := listener.get(0)) is not None:
                    burst.append(more)
                yield [decode(each.payload) for each in burst]
                self._leaving.wait(_ECHO_S)

    def _show_message(self, topic: str, values: list[Any]) -> None:
        if self._echoed != topic:
            return
        found = [dict(numbers(each)) for each in values]
        if self._field is None:
            self._field = first_plotted(found[-1])
        self._numbers.extend(each[self._field] for each in found if self._field in each)
        plotted = list(self._numbers)
        value = f"{self._field} = {plotted[-1]:g}" if plotted else f"there is no number {self._field} in it"
        spread = f"   ({min(plotted):g} … {max(plotted):g})" if plotted else ""
        text = "\n".join([topic, "", *lines(values[-1]), "", value + spread])
        self.query_one("#message", Static).update(Text(text))
        self.query_one("#plot", Sparkline).data = plotted


def _style(table: str, column: str, cell: str) -> str:
    """Return the style of a cell, which highlights drops and failures."""
    if column in ("dropped", "lost") and cell not in ("", "0"):
        return "bold red"
    return _STATES.get(cell, "") if table == "nodes" and column == "state" else ""
