"""A strict type checker agrees with what messages accept and hold, and with what tests ask for."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from busflow.interfaces import field_types as aliases
from busflow.interfaces.fields import PRIMITIVES

TYPED = Path(__file__).parents[1] / "typing"


def test_there_is_a_word_for_every_type_of_ros():
    scalars = {name for name in aliases.__all__ if name.islower()}
    arrays = {name.removesuffix("Array").lower() for name in aliases.__all__ if name.endswith("Array")}
    assert scalars == set(PRIMITIVES) - {"bool"}
    assert arrays == {name for name, primitive in PRIMITIVES.items() if primitive.dtype}


@pytest.mark.timeout(120)
def test_pyright_reads_messages_and_tests_as_they_are():
    """The files state types and mistakes; a mistake that pyright lets pass is an ignore too many."""
    pytest.importorskip("pyright")
    done = subprocess.run(
        [sys.executable, "-m", "pyright", "--pythonpath", sys.executable, "--outputjson", str(TYPED)],
        capture_output=True,
        text=True,
        cwd=TYPED.parents[1],
    )
    found = json.loads(done.stdout)["generalDiagnostics"]
    assert [(each["file"], each["range"]["start"]["line"] + 1, each["message"]) for each in found] == []
