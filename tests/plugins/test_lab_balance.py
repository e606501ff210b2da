"""The lab with a body as a regression test: it stands, it falls where a gain is wrong, and both can be shown again."""

from pathlib import Path

import pytest

from busflow.cli import main
from busflow.testing import harness, virtual_time
from tests.new_interpreter import printed_by

FOLDER = Path(__file__).parents[2] / "configs"
BALANCE, FALL = str(FOLDER / "lab_balance.yaml"), str(FOLDER / "lab_fall.yaml")
ANKLE = "nodes.balance_controller.parameters.ankle.p"
RUN = "import sys; from busflow.cli import main; sys.exit(main(['run', *sys.argv[1:]]))"


@pytest.mark.parametrize("seed", range(3))
@virtual_time
async def test_without_controller_it_falls_within_ten_seconds(seed):
    async with harness(BALANCE, seed=seed, args={"controller": False}) as lab:
        await lab.advance(10)
    assert [line.event for line in lab.log if line.level == "warning"][-1] == "the robot has fallen"


@pytest.mark.long
def test_three_seeds_stand_through_their_pushes(capsys):
    assert main(["test", BALANCE, "--for", "1min", "--seeds", "3"]) == 0
    assert capsys.readouterr().out == "lab_balance: 3 runs of 60s: all that it expects holds\n"


def test_fall_is_named_with_seed_time_topic(capsys):
    assert main(["test", FALL, "--for", "16s", "--seeds", "2"]) == 1
    printed = capsys.readouterr().out
    assert "lab_fall.yaml:17:26: error: pose.position.z of /pelvis/pose was 0.8" in printed
    assert " at 9.5 s, not between 0.85 and 0.95, the first of " in printed
    assert "(seed 0, as with 1 other, of 2)" in printed


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """A fall, the same in a process of its own, and one that another gain of the controller causes."""
    folder = tmp_path_factory.mktemp("falls")
    first, second, soft = (folder / f"{name}.mcap" for name in ("first", "second", "soft"))
    words = [FALL, "--sim", "--for", "12s", "--seed", "2", "--record"]
    assert main(["run", *words, str(first)]) == main(["run", *words, str(soft), "--set", f"{ANKLE}=0.3"]) == 0
    printed_by(RUN, *words, str(second))
    return first, second, soft


@pytest.mark.long
def test_one_seed_gives_same_bytes_in_two_processes(recordings):
    first, second, soft = map(Path.read_bytes, recordings)
    assert first == second
    assert first != soft


@pytest.mark.long
def test_recorded_fall_replays_exactly(recordings, capsys):
    assert main(["replay", str(recordings[0]), FALL]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("/humanoid_simulator, /sensor_processor, /balance_controller: the same as in ")
    assert "600 on /pelvis/pose" in printed


@pytest.mark.long
def test_diff_names_the_changed_gain(recordings, capsys):
    assert main(["bag", "diff", *map(str, recordings[::2]), "--topics", "/parameter_events"]) == 3
    assert "    new_parameters['ankle.p'].value.double_value: 1.4 -> 0.3\n" in capsys.readouterr().out
