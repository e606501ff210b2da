"""The lab with a body as a regression test: it falls without its controller and under hard pushes, the same for a seed.

The snippets of docs/tutorial/balance.md let it stand through pushes of three seeds, replay a fall, and find the gain
that causes one.
"""

from pathlib import Path

import pytest

from busflow.cli import main
from busflow.testing import harness, virtual_time
from tests.new_interpreter import printed_by

FOLDER = Path(__file__).parents[2] / "configs"
BALANCE, FALL = str(FOLDER / "lab_balance.yaml"), str(FOLDER / "lab_fall.yaml")
RUN = "import sys; from busflow.cli import main; sys.exit(main(['run', *sys.argv[1:]]))"


@pytest.mark.parametrize("seed", range(3))
@virtual_time
async def test_without_controller_it_falls_within_ten_seconds(seed):
    async with harness(BALANCE, seed=seed, args={"controller": False}) as lab:
        await lab.advance(10)
    assert "stood_s" in [line.values for line in lab.log if line.level == "warning"][-1]


def test_fall_is_named_with_seed_time_topic(capsys):
    assert main(["test", FALL, "--for", "16s", "--seeds", "2"]) == 1
    printed = capsys.readouterr().out
    assert "lab_fall.yaml:17:26: error: pose.position.z of /pelvis/pose was 0.8" in printed
    assert " at 9.5 s, " in printed
    assert " 0.85 and 0.95, " in printed
    assert "(seed 0, " in printed


@pytest.mark.long
def test_one_seed_gives_same_bytes_in_two_processes(tmp_path):
    words = [FALL, "--sim", "--for", "12s", "--seed", "2", "--record"]
    assert main(["run", *words, str(tmp_path / "first.mcap")]) == 0
    printed_by(RUN, *words, str(tmp_path / "second.mcap"))
    assert (tmp_path / "first.mcap").read_bytes() == (tmp_path / "second.mcap").read_bytes()
