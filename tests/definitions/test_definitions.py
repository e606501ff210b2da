"""What the package says of a definition: names, types, source text.

Tests of `comments.py`, `declarations.py`, `definition.py`, `field_type.py`, `generator.py`, `lines.py`,
`packages.py` and `python_text.py`; the parser has more in `test_reader.py`, and `export.py` its tests where the
command has them, in `tests/cli/interface/test_interface.py`.
"""

import pytest

from busflow.definitions.definition import Kind, kind_of
from busflow.definitions.field_type import full_name, read_type, short_name
from busflow.definitions.lines import split
from busflow.definitions.python_text import docstring, from_import, literal, sort_key
from busflow.interfaces.encoding.description import Count


def test_kind_is_the_middle_of_a_name():
    names = ("a/msg/B", "a/srv/B", "a/action/B", "a/B", "a/x/B", "B", "a/srv/c/B")
    assert [kind_of(name) for name in names] == [Kind.MESSAGE, Kind.SERVICE, Kind.ACTION, None, None, None, None]


def test_names_are_short_and_full():
    assert short_name("std_msgs/msg/Header") == "std_msgs/Header"
    assert short_name("std_srvs/srv/Empty") == "std_srvs/srv/Empty"
    assert [full_name(name, "a") for name in ("B", "c/D", "c/msg/D")] == ["a/msg/B", "c/msg/D", "c/msg/D"]


def test_recorded_type_may_have_any_name():
    assert read_type("Header", "a", lenient=True).base == "std_msgs/msg/Header"
    assert read_type("some_type[2]", "a", lenient=True).base == "a/msg/some_type"
    assert read_type("string<=5[<=3]", "a").count is Count.BOUNDED


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("int8 a", ("int8", "a", None, None)),
        ("\tint8\ta\t1\t#\tb", ("int8", "a", "1", "\tb")),
        ('string A="x # y" # z', ("string", "A", '"x # y"', " z")),
        ("string[] a ['#', \"b\"] ## c", ("string[]", "a", "['#', \"b\"]", " c")),
        ("string a it's # b", ("string", "a", "it's", " b")),
        ("# only", (None, None, None, " only")),
        ("", (None, None, None, None)),
    ],
)
def test_line_is_split_into_words(text, words):
    line = split(1, text)
    found = (line.type, line.name, line.value)
    assert (*(word and word.text for word in found), line.comment) == words
    assert all(text[word.column :].startswith(word.text) for word in found if word)


@pytest.mark.parametrize("value", ["it's", 'a "b"', "a\\b", "a\nb", "é", 1.0, True, 0, -1e300])
def test_literal_is_read_back_by_python(value):
    assert eval(literal(value)) == value  # noqa: S307  # its own text


@pytest.mark.parametrize(
    "text", ["One.", 'Ends in "quotes"', 'Has """three""".', "Ends in \\", "a\n\n  b\nc", "x " * 200]
)
def test_docstring_holds_its_text(text):
    lines = docstring(text, 2)
    assert max(map(len, lines)) <= 120
    assert all(line.startswith("        ") for line in lines if line)
    namespace = {}
    exec("\n".join(["class A:", "    class B:", *lines]), namespace)  # noqa: S102  # its own text
    assert namespace["A"].B.__doc__.split() == text.split()


def test_imports_are_sorted_as_ruff_sorts_them():
    names = ["uint8", "UInt8Array", "UUID", "UInt16Array", "Annotated", "int64"]
    assert sorted(names, key=sort_key) == ["UUID", "Annotated", "UInt8Array", "UInt16Array", "int64", "uint8"]
    assert from_import("a", ["b" * 120, "c"]) == ["from a import (", f"    {'b' * 120},", "    c,", ")"]
