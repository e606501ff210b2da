"""`busflow config` prints the resolved file, which can be read back, and where each value came from."""

import math
from pathlib import Path
from tempfile import NamedTemporaryFile

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from busflow.cli import main
from busflow.launchfile.load.load import load
from busflow.launchfile.yaml.block import lines
from busflow.launchfile.yaml.value import Origin, StatedBy, Value
from tests.cli.conftest import Shell

scalars = (
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**63 - 1)
    | st.floats(allow_nan=False)
    | st.text()
    | st.sampled_from(
        ["yes", "on", "12:30", "010", "1e3", "~", "null", "${args.x}", "$${x}", "-", "a: b", "# c", ".inf"]
    )
)
keys = st.text().filter(lambda text: "${" not in text)  # a key cannot hold an expression
names = keys.filter(lambda text: "." not in text)  # a dotted name of a parameter is read as a group
documents = st.dictionaries(
    names,
    st.recursive(
        scalars, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3), max_leaves=8
    ),
    min_size=1,
    max_size=4,
)


@given(documents)
def test_printed_config_reads_back_equal(data: dict[str, object]):
    node = {"plugin": "talker", "parameters": data}
    printed = "\n".join(lines(Value.of({"nodes": {"talker": node}}, Origin(StatedBy.DEFAULT))))
    assert all(" " <= each < "\x7f" or each == "\n" or each >= "\xa0" for each in printed)
    with NamedTemporaryFile("w", suffix=".yaml", encoding="utf-8") as file:
        file.write(printed)
        file.flush()
        (spec,) = load(file.name).nodes
    assert spec.parameters.data == data


def test_numbers_that_are_none_are_yamls():
    (line,) = lines(Value.of({"a": math.nan}, Origin(StatedBy.DEFAULT)))
    assert line.startswith("a: .nan")


@pytest.mark.parametrize("word", ["yes", "On", "n", "null", "1e3", "010", "a: b", "", "${x}"])
def test_a_text_stays_text_for_every_reader(word: str):
    (line,) = lines(Value.of({"a": word}, Origin(StatedBy.DEFAULT)))
    assert yaml.safe_load(line) == {"a": word.replace("${", "$${")}


WIDTH = {" +# from": "  # from"}
"""The path of a temporary folder widens the first column."""


@pytest.mark.usefixtures("project")
def test_each_value_shows_its_origin(shell: Shell):
    assert shell("config talk.yaml rate_hz:=50 --set nodes.listener.restart=always", mask=WIDTH) == 0
    answer = shell.data("config talk.yaml")
    assert answer["config"]["nodes"]["talker"]["parameters"]["rate_hz"] == 100.0
    assert answer["origins"]["nodes.talker.plugin"] == "talk.yaml:7:13"


@pytest.mark.usefixtures("project")
def test_printed_config_can_be_run(shell: Shell):
    Path("resolved.yaml").write_text(shell.text("config talk.yaml rate_hz:=50"))
    assert main(["check", "resolved.yaml"]) == 0
    assert "rate_hz: 50.0" in shell.text("config resolved.yaml")


@pytest.mark.usefixtures("project")
def test_unloadable_plugin_is_shown_as_stated(shell: Shell):
    Path("plugins/talker.py").write_text("raise ValueError")
    assert shell("config talk.yaml", mask=WIDTH) == 0
