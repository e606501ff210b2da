"""Reading YAML: data only, within limits, every value with its place, never a crash."""

import os
import resource
from pathlib import Path

import pytest
import yaml
from hypothesis import example, given
from hypothesis import strategies as st

from busflow.errors import LaunchError, Place
from busflow.launchfile.yaml.document import (
    MAX_BYTES,
    MAX_BYTES_WITHOUT_LIBYAML,
    MAX_DEPTH,
    Limits,
    parse,
    parse_value,
    read_file,
)
from busflow.text import printable
from tests.golden import Golden

LOADERS = [pytest.param(yaml.CSafeLoader, id="libyaml"), pytest.param(yaml.SafeLoader, id="pure")]


def read(text: str | bytes, loader: object = None) -> object:
    return parse(text if isinstance(text, bytes) else text.encode(), "lab1.yaml", loader=loader).data


def refused(text: str | bytes, loader: object = None) -> str:
    with pytest.raises(LaunchError) as caught:
        read(text, loader)
    return str(caught.value)


@pytest.mark.parametrize("loader", LOADERS)
def test_both_parsers_read_the_same(loader: object):
    text = """
    # a comment
    a: {b: [1, 2.5, on], "c d": 'it''s'}
    e:
      - f: |
          two
          lines
      - ~
    ? g
    : "\\u00e9\\x1b"
    """
    assert read(text, loader) == {
        "a": {"b": [1, 2.5, "on"], "c d": "it's"},
        "e": [{"f": "two\nlines\n"}, None],
        "g": "é\x1b",
    }


@pytest.mark.parametrize("loader", LOADERS)
@pytest.mark.parametrize(
    ("text", "begin"),
    [
        ("", "1:1: error: the file is empty"),
        ("---\n", "1:1: error: the file is empty"),
        ("a: 1\na: 3\n", "2:1: error: the key a stands twice; it was first at lab1.yaml:1:1"),
        ("a: &x [1]\n", "1:4: error: anchors such as &x are not allowed"),
        ("&a [*a]\n", "1:1: error: anchors such as &a are not allowed"),
        ("b: *x\n", "1:4: error: aliases such as *x are not allowed"),
        ("b: {<<: {c: 1}, d: 2}\n", "1:5: error: merge keys (<<) are not allowed"),
        ("b:\n  <<: *x\n", "2:3: error: merge keys (<<) are not allowed"),
        ("a: !!python/name:os.system x\n", "1:4: error: tags such as !!python/name:os.system are not allowed"),
        ("a: ! x\n", "1:4: error: tags such as ! are not allowed"),
        ("? [a]\n: 1\n", "1:3: error: a key must be a plain word or text"),
        ("a: 1\n---\nb: 2\n", "2:1: error: a second document begins here"),
        ("a: [1, x${env.HOME}]\n", "1:9: error: an expression inside {…} or […] must be quoted"),
        ("a:\n\tb: 1\n", "2:1: error: a tab cannot indent"),
        ("a: one: two\n", "1:7: error: a ':' cannot stand here"),
        ('a: "open\n', "1:4: error: this quote is never closed"),
        ("a: @home\n", "1:4: error: a value cannot begin with '@'"),
        ('a: "one" two\n', "1:10: error: this cannot follow what is before it"),
        ("a: 9223372036854775808\n", "1:4: error: the integer 9223372036854775808 does not fit in 64 bits"),
        ("a: \x1b[31mred\n", "1:4: error: the control character U+001B is not allowed; is this a text file?"),
        ("a: x\0y\n", "1:5: error: a NUL byte is not allowed; is this a text file?"),
        (b"ok: 1\na: caf\xe9\n", "2:7: error: the byte 0xe9 is not UTF-8"),
        ("a: 1\n".encode("utf-16"), "1:1: error: the file is written in UTF-16"),
    ],
)
def test_both_parsers_report_a_mistake_at_its_place(text: str | bytes, begin: str, loader: object):
    assert refused(text, loader).startswith(f"lab1.yaml:{begin}")


def test_several_mistakes_are_reported_together():
    report = refused("a: 1\na: 2\nb: &x 1\nc: 99999999999999999999\n")
    assert [line.split(":")[1] for line in report.splitlines() if line.startswith("lab1")] == ["2", "3", "4"]


def test_utf_8_byte_order_mark_is_skipped():
    assert read(b"\xef\xbb\xbfa: 1") == {"a": 1}


def test_every_value_and_key_knows_its_place():
    value = parse(b"nodes:\n  talker: {rate: 10, names: [a, 'b c']}\n", "lab1.yaml")
    line = "  talker: {rate: 10, names: [a, 'b c']}"
    rate, second = value.find(("nodes", "talker", "rate")), value.find(("nodes", "talker", "names", 1))
    assert rate is not None
    assert second is not None
    assert rate.origin.place == Place("lab1.yaml", 2, 18, 2, line)
    assert rate.key == Place("lab1.yaml", 2, 12, 4, line)
    assert second.origin.place == Place("lab1.yaml", 2, 33, 5, line)


def test_columns_count_characters_not_bytes():
    assert refused("é: {ü: ${x}}").startswith("lab1.yaml:1:8: ")


@pytest.mark.parametrize("loader", LOADERS)
@pytest.mark.parametrize("opening", ["[", "{a: ", "- ", "[{a: "])
def test_nesting_is_read_up_to_its_limit(opening: str, loader: object, golden: Golden):
    golden(refused(opening * 20_000, loader))
    assert read("[" * MAX_DEPTH + "]" * MAX_DEPTH, loader) is not None


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000 + "]" * 100_000,
        "a: &a [x,x,x,x,x,x,x,x,x]\n"
        + "".join(f"{b}: &{b} [{f'*{a},' * 9}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)),
        "".join(f"k{i}: 1\n" for i in range(100_000))[:MAX_BYTES],
        "[" + "0," * (MAX_BYTES // 2 - 2) + "]",
        "a: " + "x" * (MAX_BYTES + 10),
        "{" + "? " * (MAX_BYTES // 2 - 2),
        "&a " * (MAX_BYTES // 3 - 1),
        "a: 1\n" * (MAX_BYTES // 5 - 1),
        "%TAG ! x\n" * (MAX_BYTES // 9 - 1),
        "a: [" + "\n" * (MAX_BYTES // 2) + "," * (MAX_BYTES // 3),
        "9" * 5000 + ": " + "9" * 5000,
    ],
    ids=[
        "brackets",
        "aliases",
        "keys",
        "values",
        "size",
        "question",
        "anchors",
        "duplicates",
        "directives",
        "lines",
        "digits",
    ],
)
def test_hostile_files_are_refused_fast_and_briefly(text: str):
    assert len(refused(text)) < 20_000  # quadratic time would exceed the test's limit


def test_half_of_a_surrogate_pair_is_refused():
    with pytest.raises(LaunchError) as caught:
        read('a: "\\ud83d"', yaml.SafeLoader)
    assert [each.code for each in caught.value.problems] == ["escape"]


def test_64_mib_are_refused_without_reading_them(tmp_path: Path, golden: Golden):
    path = tmp_path / "big.yaml"
    with path.open("wb") as file:
        file.truncate(64 << 20)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with golden.raises(LaunchError):
        read_file(path, "big.yaml")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 16 << 10


def test_size_limit_is_lower_without_libyaml(golden):
    text = "a: " + "x" * MAX_BYTES_WITHOUT_LIBYAML
    golden(refused(text, yaml.SafeLoader))


def test_several_files_share_one_limit_of_values(golden):
    limits = Limits(values=10)
    parse(b"[1, 2, 3, 4, 5]", "a.yaml", limits=limits)
    with golden.raises(LaunchError):
        parse(b"[1, 2, 3, 4, 5]", "b.yaml", limits=limits)


@pytest.mark.parametrize("kind", ["missing", "folder", "fifo", "device", "link", "secret", "nul"])
def test_unreadable_file_is_refused_without_waiting(kind: str, tmp_path: Path, golden: Golden):
    path = tmp_path / "lab1.yaml"
    if kind == "folder":
        path.mkdir()
    elif kind == "fifo":
        os.mkfifo(path)
    elif kind == "device":
        path = Path("/dev/zero")
    elif kind == "link":
        path.symlink_to(tmp_path / "nowhere")
    elif kind == "nul":
        path = Path("a\0b")
    elif kind == "secret":
        path.touch(mode=0)
        if os.access(path, os.R_OK):
            pytest.skip("root reads everything")
    with golden.raises(LaunchError):
        read_file(path, "lab1.yaml")


def outcome(text: str | bytes, loader: object) -> tuple[object, str]:
    """Return the data of a text, or the report of its problems."""
    try:
        return read(text, loader), ""
    except LaunchError as error:
        return None, str(error)


@given(st.binary(max_size=60))
@example(b"a: \xff")
@example(b"%YAML 3.0\n--- a")
@example(b'"\\U00110000"')
def test_any_bytes_are_read_or_refused(raw: bytes):
    for loader in (yaml.CSafeLoader, yaml.SafeLoader):
        _, report = outcome(raw, loader)
        assert all(line == printable(line) for line in report.split("\n"))


@given(st.text(st.sampled_from("ab:-?[]{},&*!|>'\"%@`#$~ \n\t\\01.é\x1b"), max_size=40))
def test_both_parsers_read_or_refuse_any_text(text: str):
    (one, first), (other, second) = outcome(text, yaml.CSafeLoader), outcome(text, yaml.SafeLoader)
    assert all(line == printable(line) for line in f"{first}\n{second}".split("\n"))
    # The parsers differ in what they refuse (tabs, odd keys), not in what they read.
    assert repr(one) == repr(other) or first or second


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5", 5),
        ("on", "on"),
        (" ", " "),
        ("[1, 'a b', {c: true}]", [1, "a b", {"c": True}]),
        ('"5"', "5"),
        ("a: b # c", "a: b # c"),
        ("@x", "@x"),
        ("!!python/object:x", "!!python/object:x"),
        ("*a", "*a"),
        ("True", True),
        ("1e3", 1000.0),
    ],
)
def test_command_line_value_is_scalar_or_flow(text: str, value: object):
    assert parse_value(text, "command line").data == value


@pytest.mark.parametrize(
    ("text", "begin"),
    [
        ("[1, 2", "1:7: error: this bracket is never closed with ']'"),
        ("[*a]", "1:8: error: aliases such as *a are not allowed"),
        ("[a, !!x b]", "1:11: error: tags such as !!x are not allowed"),
        ("\x1b[2J", "1:7: error: the value holds the control character U+001B"),
        ("[" * 100_000, "1:72: error: nested deeper than 64 levels"),
    ],
)
def test_wrong_command_line_value_names_its_column(text: str, begin: str):
    with pytest.raises(LaunchError) as caught:
        parse_value(text, "command line", "--set=")
    assert str(caught.value).startswith(f"command line:{begin}")
