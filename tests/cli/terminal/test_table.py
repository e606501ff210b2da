"""Tables in terminals: how they shrink, and that no word is broken."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from busflow.cli import main
from busflow.cli.terminal.table import Column, bare, narrowed, table_lines
from tests.golden import Golden

LEDGER = (Column("topic"), Column("type", short=bare, goes=1), Column("rate", right=True, goes=2), Column("lost"))
ROWS = [("/imu/data", "sensor_msgs/msg/Imu", "9.0 Hz", 0), ("  → /filter", "depth 5, drop_oldest", "", 12)]
CONFIGS = Path(__file__).parents[3] / "configs"
InTerminal = Callable[..., list[str]]
Captured = pytest.CaptureFixture[str]


def laid(width: int | None, rows: list[tuple[object, ...]] = ROWS, columns: tuple[Column, ...] = LEDGER) -> list[str]:
    lines = list(table_lines(rows, *columns, width=width))
    return [re.sub(r"\x1b\[[0-9;]*m", "", line) for line in lines]


LONG = [("/left/arm/joint_states", "sensor_msgs/msg/JointState", "9.0 Hz", 0), ("  → /filter", "depth 5", "", 12)]
FLOWS = (Column("node"), *(Column(title) for title in ("delivered", "dropped", "queued")))
FOLDING = (Column(), Column(folds=True))
TABLES: dict[str, tuple[int | None, list[tuple[object, ...]], tuple[Column, ...]]] = {
    "any width": (None, ROWS, LEDGER),
    "short types": (46, ROWS, LEDGER),
    "no types": (33, ROWS, LEDGER),
    "no rates": (24, ROWS, LEDGER),
    "long names on lines of their own": (26, LONG, LEDGER),
    "sentences": (25, [("/a", 10, 2, ""), ("/arm/left/elbow/joint_states", 1, 2, 3)], FLOWS),
    "a folded column": (30, [("rate_hz", "How often the sensors publish, Hz."), ("noise", "")], FOLDING),
    "a long word in a folded column": (30, [("from", "/a/b " + "x" * 26)], FOLDING),
    "a path that folds": (31, [("from", "/a/" + "x" * 25)], FOLDING),
    "a path that does not fold": (28, [("from", "/" + "x" * 22)], FOLDING),
    "wide characters": (None, [("あい", 1), ("abcd", 2)], ()),
}


@pytest.mark.parametrize("case", TABLES)
def test_output(case: str, golden: Golden):
    lines = laid(*TABLES[case])
    golden("\n".join(lines))
    width = TABLES[case][0]
    assert width is None or all(len(line) <= width for line in lines)


def test_table_that_just_fits_is_unchanged():
    assert laid(47) == laid(None)


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
def test_names_are_cut_before_figures_in_rows(room: int, titles: list[str], first: tuple[str, ...]):
    rows = [("/left/arm/joint_states", "sensor_msgs/msg/JointState", "9.0 Hz", "0"), ("/imu", "a/b/C", "", "12")]
    columns, cells = narrowed(rows, LEDGER, room, gap=2)
    assert [column.title for column in columns] == titles
    assert cells[0] == first


def test_wide_characters_take_two_places():
    assert all(len(line) <= 10 for line in laid(12, [("あい", "うえお かきく")], (Column(), Column(folds=True))))


@pytest.mark.e2e
@pytest.mark.parametrize("width", [60, 40])
def test_end_tables_break_no_word(in_terminal: InTerminal, width: int):
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
def test_command_output_breaks_no_word(command: list[str], in_terminal: InTerminal, capsys: Captured):
    assert main(command) == 0
    words = {word for line in capsys.readouterr().out.splitlines() for word in re.findall(r"[^\s/,]+", line)}
    lines = in_terminal(60, *command)
    assert max(map(len, lines)) <= 60
    changing = {"ps": {"AGE"}}
    shown = {word for line in lines for word in re.findall(r"[^\s/,]+", line)}
    assert {word for word in shown - words if not re.search(r"\d", word)} <= changing.get(command[0], set())


@pytest.mark.e2e
def test_files_get_the_full_table(in_terminal: InTerminal, capsys: Captured):
    assert main(["plugins", "info", "player"]) == 0
    whole = capsys.readouterr().out
    assert max(map(len, whole.splitlines())) > 60 >= max(map(len, in_terminal(60, "plugins", "info", "player")))
