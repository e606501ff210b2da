"""The one place that compiles: a function of what it was given, and of nothing else."""

import pytest

from busflow.errors import InvalidDeclaration
from busflow.interfaces.codegen import FunctionSource, word


def test_lines_become_a_function_of_given_values():
    source = FunctionSource()
    three = source.give([3])
    source.add("if number > 0:")
    source.indent(1)
    source.add(f"return number + {three}[0]")
    source.indent(-1)
    source.add(f"return {source.give(None)}")
    function = source.function("number")
    assert (function(1), function(-1)) == (4, None)


def test_each_object_has_one_name_of_its_own():
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
def test_an_unsafe_field_name_enters_no_generated_line(name):
    with pytest.raises(InvalidDeclaration):
        word(name)
    assert word("frame_id2") == "frame_id2"
