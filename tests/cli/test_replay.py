"""`busflow replay`: shows on the command line whether a change of code changes behaviour."""

import json
from pathlib import Path

import pytest

from busflow.cli import main
from busflow.recording.bag.bag import Bag

ROOT = Path(__file__).parents[2]
LAB = str(ROOT / "configs/lab1.yaml")
BUG = ("(abs(imu.linear_acceleration.y) + rotation)", "(abs(imu.linear_acceleration.x) + rotation)")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    path = tmp_path_factory.mktemp("lab") / "run.mcap"
    assert main(["run", LAB, "--sim", "--for", "10s", "--seed", "5", "--record", str(path)]) == 0
    return str(path)


def buggy_plugins(tmp_path):
    """The lab's plugins, with a bug in the processor."""
    folder = tmp_path / "plugins"
    folder.mkdir()
    for name in ("sensor_publisher", "sensor_processor"):
        text = (ROOT / f"plugins/{name}.py").read_text(encoding="utf-8")
        (folder / f"{name}.py").write_text(text.replace(*BUG), encoding="utf-8")
    return folder


def test_an_unchanged_node_is_the_same(capsys, bag):
    capsys.readouterr()
    assert main(["replay", bag, LAB, "--node", "sensor_processor"]) == 0
    output = capsys.readouterr()
    assert output.out == (
        f"/sensor_processor: the same as in {bag}; compared: 100 on /balance_state, 100 on /stability_index\n"
    )


def test_all_nodes_are_replayed_by_default(capsys, bag):
    assert main(["replay", bag, LAB, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["same"]
    assert answer["nodes"] == ["/sensor_publisher", "/sensor_processor"]
    assert answer["compared"]["/imu/data"] == 100


def test_bug_is_found_with_field_and_exit_code(capsys, bag, tmp_path):
    folder = buggy_plugins(tmp_path)
    assert main(["replay", bag, "--plugin", "sensor_processor", "--folder", str(folder), "--show", "1"]) == 3
    first, second, rest = capsys.readouterr().out.splitlines()
    assert first.startswith("/sensor_processor: 200 differences from ")
    assert second.startswith("  /balance_state #1 at 0.100000000 s: data: 0.")
    assert rest == "  … and 199 more"


def test_json_names_each_difference(capsys, bag, tmp_path):
    folder = buggy_plugins(tmp_path)
    assert main(["replay", bag, "--plugin", "sensor_processor", "--folder", str(folder), "--json"]) == 3
    answer = json.loads(capsys.readouterr().out)
    assert (answer["same"], answer["difference_count"]) == (False, 200)
    first = answer["differences"][0]
    assert (first["kind"], first["topic"], first["number"]) == ("content", "/balance_state", 1)
    assert first["fields"][0]["path"] == "data"


def test_plugin_runs_under_the_given_name(capsys, bag):
    folder = str(ROOT / "plugins")
    assert main(["replay", bag, "--plugin", "sensor_publisher", "--folder", folder, "--node", "sensor_publisher"]) == 0
    assert main(["replay", bag, "--plugin", "sensor_publisher", "--folder", folder, "--node", "other"]) == 3
    assert "/other" in capsys.readouterr().out


def test_node_without_recorded_topics_is_refused(capsys, bag, tmp_path):
    folder = str(ROOT / "plugins")
    out = tmp_path / "new.mcap"
    command = ["replay", bag, "--plugin", "sensor_publisher", "--folder", folder, "--node", "left/other"]
    assert main([*command, "--record", str(out)]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert "/left/other cannot be replayed on this recording, which has none of the topics: /left/" in output.err
    assert not out.exists()


def test_a_replay_is_recorded(capsys, bag, tmp_path):
    out = tmp_path / "out.mcap"
    assert main(["replay", bag, LAB, "--record", str(out)]) == 0
    with Bag(out) as new, Bag(bag) as old:
        assert new.digest() == old.digest()
    assert capsys.readouterr()


def test_incomplete_recording_is_refused(capsys, bag, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(Path(bag).read_bytes()[:-3000])
    assert main(["replay", str(cut), LAB]) == 5
    assert "is not the whole of what happened: " in capsys.readouterr().err
    assert main(["replay", str(cut), LAB, "--node", "sensor_processor", "--incomplete"]) in {0, 3}


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ([], "name a launch file after the recording, or a plugin with --plugin"),
        ([LAB, "--plugin", "x"], "name a launch file after the recording, or a plugin with --plugin"),
        (["--plugin", "x", "--node", "a", "--node", "b"], "--plugin runs one node"),
        ([LAB, "--node", "sensor"], f"{LAB} has no node /sensor; known: /sensor_processor"),
        (["--plugin", "nothing"], "there is no plugin 'nothing'"),
        ([LAB, "--tolerance", "nan"], "nan is not a number"),
    ],
)
def test_wrong_usage_is_explained(capsys, bag, arguments, why):
    assert main(["replay", bag, *arguments]) == 2
    assert why in capsys.readouterr().err


def test_a_recording_that_is_not_there(capsys):
    assert main(["replay", "nothing.mcap", LAB]) == 2
    assert "nothing.mcap: it cannot be opened" in capsys.readouterr().err
