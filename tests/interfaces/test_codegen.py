"""The one place that compiles: a function of what it was given, and of nothing else."""

import pytest

from busflow.errors import InvalidDeclaration
from busflow.interfaces.codegen import FunctionSource, word


def test_lines_become_a_function_of_what_they_were_given():
    source = FunctionSource()
    three = source.give([3])
    source.add("if number > 0:")
    source.indent(1)
    source.add(f"return number + {three}[0]")
    source.indent(-1)
    source.add(f"return {source.give(None)}")
    function = source.function("number")
    assert (function(1), function(-1)) == (4, None)


def test_one_value_has_one_name_and_equal_ones_have_their_own():
    source = FunctionSource()
    value = [1]
    assert source.give(value) == source.give(value) != source.give([1])


@pytest.mark.parametrize("text", ["open", "__import__('os')", "print"])
def test_nothing_else_can_be_named(text):
    source = FunctionSource()
    source.add(f"return {text}")
    with pytest.raises(NameError):
        source.function("value")(1)


@pytest.mark.parametrize("name", ["x; import os", "X", "", "x\n", "class", "é", "__class__", "a.b"])
def test_a_field_that_is_no_plain_word_is_not_written_into_a_line(name):
    with pytest.raises(InvalidDeclaration, match="names no field"):
        word(name)
    assert word("frame_id2") == "frame_id2"
