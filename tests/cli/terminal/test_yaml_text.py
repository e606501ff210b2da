"""Printed YAML: PyYAML reads it back unchanged, and would write it in the same form."""

import sys

import pytest
import yaml
from hypothesis import assume, given
from hypothesis import strategies as st

from busflow.cli.terminal.yaml_text import yaml_lines, yaml_text
from busflow.text import UNSAFE
from tests.golden import Golden

WORDS = """yes no On ~ null 1e3 0o7 0x1 1:30 2001-01-01 --- ... a:b a#b 'x' - ?a :a a: .5 .inf = << 010 1_0 Y y 1."""
TEXTS = st.text() | st.text("abc:#-, ?'\"[]{}.~=<>09_e+yN \t\n\x1b%@`&*!|\\") | st.sampled_from(WORDS.split())
VALUES = st.recursive(
    TEXTS | st.integers() | st.floats(allow_nan=False) | st.booleans() | st.none(),
    lambda inner: st.lists(inner) | st.dictionaries(TEXTS.filter(lambda key: len(key) < 100), inner),
    max_leaves=12,
)


@given(VALUES, st.booleans())
def test_written_yaml_is_read_back(value: object, flow: bool):
    assert yaml.safe_load("\n".join(yaml_lines(value, flow=flow))) == value


@given(TEXTS)
def test_text_is_quoted_as_pyyaml_quotes_it(text: str):
    assume(not UNSAFE.search(text) and "\ufeff" not in text)
    theirs = yaml.dump([text], allow_unicode=True, width=sys.maxsize, default_flow_style=False)
    # More is quoted here: what newer readers take for numbers, and spaces of other scripts at an end.
    assert f"- {yaml_text(text)}\n" in (theirs, f"- '{text}'\n")


@given(st.text(st.characters()) | st.sampled_from(["\ud800", "\x9b31m", "\u202e", "\ufeff"]))
def test_nothing_that_could_steer_a_terminal_is_written(text: str):
    (line,) = yaml_lines({"text": text})
    assert not UNSAFE.search(line)


def test_lists_stand_as_in_ros2(golden: Golden):
    value = {"points": [{"x": 1.0, "y": [1, 2]}, {}], "none": [], "nested": [[1], [[2]]]}
    golden("\n".join(yaml_lines(value)))
    golden("\n".join(yaml_lines(value, flow=True)), "flow")


@pytest.mark.parametrize(("number", "text"), [(1e20, "1.0e+20"), (float("-inf"), "-.inf"), (-0.0, "-0.0"), (3, "3")])
def test_numbers_are_those_of_pyyaml(number: float, text: str):
    assert list(yaml_lines(number)) == [text]
    assert yaml.dump(number).splitlines()[0] == text
