"""Values: plain data with origins, merged and changed without changing the originals."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from busflow.launchfile.yaml.value import Origin, StatedBy, Value

FILE, COMMAND = Origin(StatedBy.FILE), Origin(StatedBy.COMMAND_LINE)
LEAVES = st.one_of(st.none(), st.booleans(), st.integers(), st.text(max_size=3))
TREES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("abcd"), inner, max_size=3),
)


def merged(below: Any, above: Any) -> Any:
    """Merge plain data by the same rule."""
    if isinstance(below, dict) and isinstance(above, dict):
        return {**below, **{k: merged(below[k], v) if k in below else v for k, v in above.items()}}
    return above


@given(TREES)
def test_plain_data_survives(data: Any):
    assert Value.of(data, FILE).data == data


@given(TREES, TREES)
def test_only_mappings_are_merged(below: Any, above: Any):
    first, second = Value.of(below, FILE), Value.of(above, COMMAND)
    assert first.merged(second).data == merged(below, above)
    assert (first.data, second.data) == (below, above)


@given(TREES, TREES)
def test_each_leaf_of_a_merge_keeps_its_origin(below: Any, above: Any):
    first, second = Value.of(below, FILE), Value.of(above, COMMAND)
    for path, leaf in first.merged(second).leaves():
        source = second if second.find(path) is not None else first
        assert leaf.origin == source.nearest(path).origin


@given(TREES)
def test_every_leaf_is_found_set_and_removed(data: Any):
    tree = Value.of(data, FILE)
    for path, leaf in tree.leaves():
        found = tree.find(path)
        assert found is not None
        assert found.data == leaf.data
        changed = tree.with_member(path, Value("new", COMMAND))
        there = changed.find(path)
        assert there is not None
        assert (there.data, there.origin) == ("new", COMMAND)
        if path and isinstance(path[-1], str):
            assert tree.without(path).find(path) is None
        assert tree.data == data


def test_nearest_finds_the_closest_stated_parent():
    tree = Value.of({"a": {"b": 1}}, FILE)
    assert tree.nearest(("a", "c", 0)).data == {"b": 1}
    assert tree.nearest(("x",)) is tree
    assert tree.find(("a", "b", "c")) is None
    assert tree.find(("a", 5)) is None


def test_followed_path_ends_at_scalars_and_missing_items():
    tree = Value.of({"a": [{"b": 1}], "c": None}, FILE)
    assert tree.followed(("a", "0", "new", "d")) == (("a", 0, "new", "d"), 4)
    assert tree.followed(("a", "1", "b")) == (("a", "1", "b"), 1)
    assert tree.followed(("a", "0", "b", "c")) == (("a", 0, "b", "c"), 3)
    assert tree.followed(("c", "d")) == (("c", "d"), 2)
