"""Editing a launch file in place: the value is in the text, and nothing else has changed."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from busflow.errors import LaunchError
from busflow.launchfile.yaml.document import parse
from busflow.launchfile.yaml.edit import edit

FILE = """\
# The lab.
name: lab1

nodes:
  sensors:  # two of them
    plugin: 'sensors'   # as it is
    parameters:
      rate_hz: ${args.rate_hz}  # Hz
      noise:
        imu: 0.1      # half width
        # none of the joints
        joints: 0.0
      limits: {low: 0, high: 1.5}  # rad
      names: [a, "b",
              c]  # three
      joints:
        # the upper one
        - name: hip   # first
          gain: 1
        - name: knee
      text: |  # long
        two
        lines

      empty:
      # the end
  watcher:
    plugin: watcher
    parameters:   # none yet

expect: {}
"""
HERE = ("nodes", "sensors", "parameters")


def loaded(text):
    return parse(text.encode(), "lab.yaml").data


def changed_lines(before, after):
    """Return the removed and the added lines."""
    old, new = before.splitlines(), after.splitlines()
    return [each for each in old if each not in new], [each for each in new if each not in old]


@pytest.mark.parametrize(
    ("path", "value", "went", "came"),
    [
        ((*HERE, "rate_hz"), 20.0, ["      rate_hz: ${args.rate_hz}  # Hz"], ["      rate_hz: 20.0  # Hz"]),
        ((*HERE, "noise", "imu"), 0.5, ["        imu: 0.1      # half width"], ["        imu: 0.5      # half width"]),
        ((*HERE, "noise"), {"imu": 0.1, "joints": 1}, ["        joints: 0.0"], ["        joints: 1"]),
        ((*HERE, "noise", "camera"), 2, [], ["        camera: 2"]),
        ((*HERE, "gain"), 2, [], ["      gain: 2"]),
        ((*HERE, "pid"), {"p": 1, "i": [0, 1]}, [], ["      pid:", "        p: 1", "        i: [0, 1]"]),
        (
            (*HERE, "limits", "high"),
            2.5,
            ["      limits: {low: 0, high: 1.5}  # rad"],
            ["      limits: {low: 0, high: 2.5}  # rad"],
        ),
        (
            (*HERE, "limits", "mid"),
            "a, b",
            ["      limits: {low: 0, high: 1.5}  # rad"],
            ['      limits: {low: 0, high: 1.5, mid: "a, b"}  # rad'],
        ),
        ((*HERE, "names"), ["a", "b", "d"], ["              c]  # three"], ["              d]  # three"]),
        ((*HERE, "names"), ["a", "b", "c", "d"], ["              c]  # three"], ["              c, d]  # three"]),
        ((*HERE, "joints", 0, "gain"), 2, ["          gain: 1"], ["          gain: 2"]),
        ((*HERE, "joints", "1", "gain"), 2, [], ["          gain: 2"]),
        ((*HERE, "joints"), [{"name": "hip", "gain": 1}], ["        - name: knee"], []),
        (
            (*HERE, "joints"),
            [{"name": "hip", "gain": 1}, {"name": "knee"}, {"name": "toe"}],
            [],
            ["        - {name: toe}"],
        ),
        (
            (*HERE, "text"),
            "short",
            ["      text: |  # long", "        two", "        lines"],
            ["      text: short  # long"],
        ),
        ((*HERE, "empty"), 5, ["      empty:"], ["      empty: 5"]),
        ((*HERE, "empty", "x"), 5, [], ["        x: 5"]),
        ((*HERE, "empty"), None, [], []),
        (("nodes", "watcher", "parameters", "a", "b"), True, [], ["      a:", "        b: true"]),
        (("expect", "duration"), "1min", ["expect: {}"], ['expect: {duration: "1min"}']),
        (("seed",), 7, [], ["seed: 7"]),
        (("name",), "${x}", ["name: lab1"], ['name: "$${x}"']),
    ],
)
@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_only_the_lines_that_hold_the_value_change(path, value, went, came, line_end):
    text = FILE.replace("\n", line_end)
    edited = edit(text, path, value)
    assert changed_lines(text, edited) == (went, came)
    assert edited.count(line_end) == edited.count("\n")


def test_the_same_value_changes_nothing():
    data = loaded(FILE)
    assert edit(FILE, (*HERE, "joints"), data["nodes"]["sensors"]["parameters"]["joints"]) == FILE


@pytest.mark.parametrize(
    ("text", "path", "value", "expected"),
    [
        ("a: 1", ("b",), 2, "a: 1\nb: 2"),
        ("a:", ("a",), 2, "a: 2"),
        ("a:", ("a", "b"), 2, "a:\n  b: 2"),
        ("a: {b}\n", ("a", "b"), 2, "a: {b: 2}\n"),
        ("a: {b: }\n", ("a", "b"), 2, "a: {b: 2}\n"),
        ("a: {b: 1, }\n", ("a", "c"), 2, "a: {b: 1, c: 2, }\n"),
        ("a:\n- 1 # one\n- 2 # two\n", ("a",), [1], "a:\n- 1 # one\n"),
        ("a:\n- 1 # one\n- 2 # two\n", ("a",), [], "a:\n  [] # two\n"),
        ("a: # list\n  - 1\n# end\nb: 1\n", ("a",), None, "a: # list\n    null\n# end\nb: 1\n"),
        ("a: [1, 2] # x\n", ("a",), [1], "a: [1] # x\n"),
        ("a: 'x''y' # q\n", ("a",), 1, "a: 1 # q\n"),
        ("\ufeffa: 1\n", ("a",), 2, "\ufeffa: 2\n"),
        ("---\na: 1\n...\n", ("b",), 2, "---\na: 1\nb: 2\n...\n"),
        ("a: 1\n", ("a",), math.inf, "a: .inf\n"),
        ("a: 1\n", ("a",), "line\nend\x07", 'a: "line\\nend\\u0007"\n'),
    ],
)
def test_values_are_written_as_expected(text, path, value, expected):
    assert edit(text, path, value) == expected


@pytest.mark.parametrize(
    ("text", "path", "value", "said"),
    [
        ("a: 1\n", ("a", "b"), 2, "a.b: 1 stands where b would belong"),
        ("a: [1]\n", ("a", 1), 2, "there is no 1 in a list of 1"),
        ("a: [1]\n", ("a", "x"), 2, "there is no x in a list of 1"),
        ("a: *x\n", ("a",), 2, "aliases"),
        ("a: 1\n", ("a",), 2**70, "cannot be written"),
        ("a: 1\n", ("a",), "\ud800", "cannot be written"),
        ("a: |\n  no line end follows", ("b",), 2, "cannot be written"),
    ],
)
def test_edit_without_a_place_is_refused(text, path, value, said):
    with pytest.raises(LaunchError, match=said):
        edit(text, path, value)


# Any file and any value.

KEYS = st.sampled_from(["a", "b", "rate_hz", "yes", "x y", "1"])
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**63 - 1)
    | st.floats()
    | st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
    | st.sampled_from(["${x}", "yes", "1.0", "# no", "a: b", "- x", "~", ""])
)
VALUES = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3), max_leaves=6
)
COMMENTS = st.sampled_from(["", " # one", "   # two: [x]", " # 'three"])


@st.composite
def documents(draw, depth=0):
    """Draw the lines of a mapping in block style, with members in both styles, comments and blank lines."""
    lines = []
    for key in draw(st.lists(KEYS, min_size=1, max_size=4, unique=True)):
        indent = "  " * depth
        if draw(st.booleans()):
            lines.append(draw(st.sampled_from(["", f"{indent}# own line", "# at the left"])))
        head = f"{indent}{key if key != '1' else chr(34) + '1' + chr(34)}:"
        kind = draw(
            st.sampled_from(["scalar", "flow", "list", "text", "nothing", "mapping" if depth < 3 else "scalar"])
        )
        comment = draw(COMMENTS)
        if kind == "mapping":
            lines += [head + comment, *draw(documents(depth=depth + 1))]
        elif kind == "list":
            items = draw(st.lists(st.sampled_from(["1", "word", "{k: 1}", "[1, 2]", "k: 1"]), min_size=1, max_size=3))
            dash = indent + draw(st.sampled_from(["", "  "])) + "- "
            lines += [head + comment, *(dash + item + draw(COMMENTS) for item in items)]
        elif kind == "text":
            lines += [f"{head} {draw(st.sampled_from('|>'))}{comment}", f"{indent}  some", "", f"{indent}  text"]
        elif kind == "nothing":
            lines.append(head + comment)
        else:
            flow = ["{}", "[]", "{b: 1, a: [x]}", "[1, {b: 2}, 'three']"]
            plain = ["1", "word", "'quoted'", '"double"', "${args.x}", "-1.5e3", "two words"]
            lines.append(f"{head} {draw(st.sampled_from(flow if kind == 'flow' else plain))}{comment}")
    return lines


def paths_of(data, path=()):
    yield path
    members = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, each in members:
        yield from paths_of(each, (*path, key))


def put(data, path, value):
    if not path:
        return value
    if isinstance(data, list):
        return [put(each, path[1:], value) if n == path[0] else each for n, each in enumerate(data)]
    return {**(data or {}), path[0]: put((data or {}).get(path[0]), path[1:], value)}


def escaped(value):
    match value:
        case dict():
            return {key: escaped(each) for key, each in value.items()}
        case list():
            return [escaped(each) for each in value]
        case str():
            return value.replace("${", "$${")
        case _:
            return value


def shape(data):
    """Return data as text that distinguishes 1, 1.0 and true and ignores the order of keys."""
    if isinstance(data, dict):
        return "{" + ",".join(f"{key!r}:{shape(data[key])}" for key in sorted(data)) + "}"
    return "[" + ",".join(map(shape, data)) + "]" if isinstance(data, list) else repr(data)


def at(data, path):
    for step in path:
        data = data[step]
    return data


@given(documents(), st.data(), VALUES, st.sampled_from(["\n", "\r\n"]), st.booleans())
@example(["a:", "- k: 1 # one", "b: 2"], None, {"k": 5}, "\n", False)
def test_edit_keeps_all_other_lines_and_comments(lines, data, value, line_end, ends):
    ends = ends or lines[-1].endswith("  text")  # a block text that no line end follows cannot be followed by anything
    text = line_end.join(lines) + line_end * ends
    before = loaded(text)
    if data is None:
        path = ("a", 0)
    else:
        path = data.draw(st.sampled_from([each for each in paths_of(before) if each]), label="path")
        holder = at(before, path)
        if (holder is None or isinstance(holder, dict)) and data.draw(st.booleans(), label="below"):
            path = (*path, data.draw(KEYS, label="key"))
    edited = edit(text, path, value)
    assert shape(loaded(edited)) == shape(put(before, path, escaped(value)))
    if not isinstance(value, dict | list) and not isinstance(at_or_none(before, path), dict | list):
        old, new = text.splitlines(), edited.splitlines()
        first = common(old, new)
        last = common(old[first:][::-1], new[first:][::-1])
        text_lines = 4 if isinstance(at_or_none(before, path), str) else 1
        assert len(old) - first - last <= text_lines
        assert len(new) - first - last <= 1
        assert edited.count("#") == text.count("#") + str(value).count("#")


def common(one, other):
    """Return how many lines are equal from the first on."""
    return next(
        (n for n, (left, right) in enumerate(zip(one, other, strict=False)) if left != right), min(len(one), len(other))
    )


def at_or_none(data, path):
    try:
        return at(data, path)
    except (KeyError, TypeError):
        return None
