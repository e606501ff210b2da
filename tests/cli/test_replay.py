"""`busflow replay`: shows on the command line whether a change of code changes behaviour."""

from pathlib import Path

import pytest

from busflow.cli import main
from busflow.recording.bag.bag import Bag
from tests.cli.conftest import Shell

ROOT = Path(__file__).parents[2]
LAB = str(ROOT / "configs/lab1.yaml")
FILES = {
    r"\S*/(run\.mcap|lab1\.yaml)": r"\1",
    r"\d+\.\d{10,}": "#.#",
    "known: assistant.*|known: balance.*": "known: …",
}
BUG = ("(abs(imu.linear_acceleration.y) + rotation)", "(abs(imu.linear_acceleration.x) + rotation)")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    path = tmp_path_factory.mktemp("lab") / "run.mcap"
    assert main(["run", LAB, "--sim", "--for", "10s", "--seed", "5", "--record", str(path)]) == 0
    return str(path)


@pytest.fixture
def buggy(tmp_path):
    """The lab's plugins, with a bug in the processor."""
    folder = tmp_path / "plugins"
    folder.mkdir()
    for name in ("sensor_publisher", "sensor_processor"):
        text = (ROOT / f"plugins/{name}.py").read_text(encoding="utf-8")
        (folder / f"{name}.py").write_text(text.replace(*BUG), encoding="utf-8")
    return str(folder)


def test_an_unchanged_node_is_the_same(shell: Shell, bag: str):
    assert shell(f"replay {bag} {LAB} --node sensor_processor", mask=FILES) == 0
    answer = shell.data(f"replay {bag} {LAB}")
    assert answer["same"]
    assert answer["nodes"] == ["/sensor_publisher", "/sensor_processor"]
    assert answer["compared"]["/imu/data"] == 100


def test_bug_is_found_with_field_and_exit_code(shell: Shell, bag: str, buggy: str):
    command = f"replay {bag} --plugin sensor_processor --folder {buggy}"
    assert shell(f"{command} --show 1", mask=FILES) == 3
    answer = shell.data(command, code=3)
    assert (answer["same"], answer["difference_count"]) == (False, 200)
    first = answer["differences"][0]
    assert (first["kind"], first["topic"], first["number"]) == ("content", "/balance_state", 1)
    assert first["fields"][0]["path"] == "data"


def test_plugin_runs_under_the_given_name(shell: Shell, bag: str, tmp_path: Path):
    command = f"replay {bag} --plugin sensor_publisher --folder {ROOT}/plugins"
    assert shell(f"{command} --node sensor_publisher", mask=FILES) == 0
    assert shell(f"{command} --node other --show 1", mask=FILES) == 3
    out = tmp_path / "new.mcap"
    assert shell(f"{command} --node left/other --record {out}", mask=FILES) == 2, "nothing of it was recorded"
    assert not out.exists()


def test_a_replay_is_recorded(bag: str, tmp_path: Path):
    out = tmp_path / "out.mcap"
    assert main(["replay", bag, LAB, "--record", str(out)]) == 0
    with Bag(out) as new, Bag(bag) as old:
        assert new.digest() == old.digest()


def test_incomplete_recording_is_refused(shell: Shell, bag: str, tmp_path: Path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(Path(bag).read_bytes()[:-3000])
    assert shell(f"replay {cut} {LAB}", mask=FILES | {r"byte \d+": "byte #"}) == 5
    assert main(["replay", str(cut), LAB, "--node", "sensor_processor", "--incomplete"]) in {0, 3}


@pytest.mark.parametrize(
    "arguments",
    [
        "",
        f"{LAB} --plugin x",
        "--plugin x --node a --node b",
        f"{LAB} --node sensor",
        "--plugin nothing",
        f"{LAB} --tolerance nan",
    ],
    ids=["nothing", "both", "two nodes", "no such node", "no such plugin", "no number"],
)
def test_wrong_usage_is_explained(shell: Shell, bag: str, arguments: str):
    assert shell(f"replay {bag} {arguments}", mask=FILES) == 2


def test_a_recording_that_is_not_there(shell: Shell):
    assert shell(f"replay nothing.mcap {LAB}", mask=FILES) == 2
