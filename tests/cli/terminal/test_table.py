"""Tables in terminals: what gives way where there is no room, and that no word is broken."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from busflow.cli import main
from busflow.cli.terminal.table import Column, bare, narrowed, table_lines

LEDGER = (Column("topic"), Column("type", short=bare, goes=1), Column("rate", right=True, goes=2), Column("lost"))
ROWS = [("/imu/data", "sensor_msgs/msg/Imu", "9.0 Hz", 0), ("  → /filter", "depth 5, drop_oldest", "", 12)]
CONFIGS = Path(__file__).parents[3] / "configs"
InTerminal = Callable[..., list[str]]
Captured = pytest.CaptureFixture[str]


def laid(width: int | None, rows: list[tuple[object, ...]] = ROWS, columns: tuple[Column, ...] = LEDGER) -> list[str]:
    lines = list(table_lines(rows, *columns, width=width))
    return [re.sub(r"\x1b\[[0-9;]*m", "", line) for line in lines]


def test_with_room_for_all_of_it_nothing_gives_way():
    whole = [
        "topic        type                    rate  lost",
        "/imu/data    sensor_msgs/msg/Imu   9.0 Hz  0",
        "  → /filter  depth 5, drop_oldest          12",
    ]
    assert laid(None) == laid(47) == whole


@pytest.mark.parametrize(
    ("width", "head", "row"),
    [
        (46, "topic        type       rate  lost", "/imu/data    Imu      9.0 Hz  0"),
        (33, "topic          rate  lost", "/imu/data    9.0 Hz  0"),
        (24, "topic        lost", "/imu/data    0"),
    ],
)
def test_types_lose_their_package_and_then_columns_go_in_their_order(width: int, head: str, row: str):
    assert laid(width)[:2] == [head, row]


def test_long_names_have_lines_of_their_own_with_the_figures_below():
    rows = [("/left/arm/joint_states", "sensor_msgs/msg/JointState", "9.0 Hz", 0), ("  → /filter", "depth 5", "", 12)]
    assert laid(26, rows) == [
        "topic",
        "  type          rate  lost",
        "/left/arm/joint_states",
        "  JointState  9.0 Hz  0",
        "  → /filter",
        "  depth 5             12",
    ]


def test_where_no_columns_have_room_the_figures_are_told_with_their_names():
    columns = (Column("node"), *(Column(title) for title in ("delivered", "dropped", "queued")))
    assert laid(25, [("/a", 10, 2, ""), ("/arm/left/elbow/joint_states", 1, 2, 3)], columns) == [
        "/a",
        "  delivered 10, dropped 2",
        "/arm/left/elbow/",
        "joint_states",
        "  delivered 1, dropped 2,",
        "  queued 3",
    ]


def test_a_column_that_folds_takes_several_lines_with_its_words_whole():
    columns = (Column(), Column(folds=True))
    assert laid(30, [("rate_hz", "How often the sensors publish, Hz."), ("noise", "")], columns) == [
        "rate_hz  How often the sensors",
        "         publish, Hz.",
        "noise",
    ]
    assert laid(30, [("from", "/a/b " + "x" * 26)], columns) == ["from", "  /a/b", "  " + "x" * 26]


@pytest.mark.parametrize(
    ("room", "titles", "first"),
    [
        (
            80,
            ["topic", "type", "rate", "lost"],
            ("/left/arm/joint_states", "sensor_msgs/msg/JointState", "9.0 Hz", "0"),
        ),
        (60, ["topic", "type", "rate", "lost"], ("/left/arm/joint_states", "JointState", "9.0 Hz", "0")),
        (48, ["topic", "rate", "lost"], ("/left/arm/joint_states", "9.0 Hz", "0")),
        (40, ["topic", "rate", "lost"], ("…/arm/joint_states", "9.0 Hz", "0")),
        (20, ["topic", "lost"], ("…oint_states", "0")),
    ],
)
def test_where_each_row_has_one_line_names_give_way_before_figures(
    room: int, titles: list[str], first: tuple[str, ...]
):
    rows = [("/left/arm/joint_states", "sensor_msgs/msg/JointState", "9.0 Hz", "0"), ("/imu", "a/b/C", "", "12")]
    columns, cells = narrowed(rows, LEDGER, room, gap=2)
    assert [column.title for column in columns] == titles
    assert cells[0] == first


def test_wide_characters_take_two_places():
    assert laid(None, [("あい", 1), ("abcd", 2)], ()) == ["あい  1", "abcd  2"]
    assert all(len(line) <= 10 for line in laid(12, [("あい", "うえお かきく")], (Column(), Column(folds=True))))


@pytest.mark.e2e
@pytest.mark.parametrize("width", [80, 60, 40])
def test_the_tables_at_the_end_of_a_run_break_no_word(in_terminal: InTerminal, width: int):
    lines = in_terminal(width, "run", str(CONFIGS / "lab1.yaml"), "--sim", "--for", "1s")
    assert max(map(len, lines)) <= width
    words = {word for line in lines for word in line.split()}
    assert {"/balance_state", "/sensor_processor", "/stability_index", "published", "delivered", "dropped"} <= words
    if width > 40:
        table = lines[lines.index("") :]
        assert table[3].split()[0] == "topic"
        assert [line.split()[-1] for line in table if "→" in line] == ["0", "0"]


COMMANDS = [
    ["ps"],
    ["topic", "list", "-t"],
    ["topic", "list", "-v"],
    ["topic", "stats"],
    ["node", "list", "-v"],
    ["node", "info", "imu_publisher"],
    ["service", "list", "-t"],
    ["service", "info", "imu_publisher/get_parameters"],
    ["param", "sources"],
    ["graph", "-a"],
]


@pytest.mark.e2e
@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_what_is_told_of_a_run_breaks_no_word(command: list[str], in_terminal: InTerminal, capsys: Captured):
    assert main(command) == 0
    words = {word for line in capsys.readouterr().out.splitlines() for word in re.findall(r"[^\s/,]+", line)}
    for width in (80, 60):
        lines = in_terminal(width, *command)
        assert max(map(len, lines)) <= width
        changing = {"ps": {"AGE"}}
        shown = {word for line in lines for word in re.findall(r"[^\s/,]+", line)}
        assert {word for word in shown - words if not re.search(r"\d", word)} <= changing.get(command[0], set())


@pytest.mark.e2e
def test_a_file_gets_all_of_it_whatever_the_terminal_is(in_terminal: InTerminal, capsys: Captured):
    assert main(["plugins", "info", "player"]) == 0
    whole = capsys.readouterr().out
    assert max(map(len, whole.splitlines())) > 60 >= max(map(len, in_terminal(60, "plugins", "info", "player")))
