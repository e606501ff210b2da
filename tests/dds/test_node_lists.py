"""The tests of `node_lists`."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.dds.node_lists import ListedNode, decode_nodes, encode_nodes, node_list_type
from busflow.errors import MalformedMessage

TYPE = node_list_type()
GIDS = st.frozensets(st.binary(min_size=16, max_size=16), max_size=3)
NODES = st.builds(ListedNode, st.sampled_from(["/", "/left/arm"]), st.sampled_from(["a", "_b1"]), GIDS, GIDS)


def test_type_of_a_node_list_is_ros2s():
    assert TYPE.type_hash == "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"


@given(st.binary(min_size=16, max_size=16), st.lists(NODES, max_size=4))
def test_node_list_is_read_as_written(participant, nodes):
    assert decode_nodes(TYPE, encode_nodes(TYPE, participant, nodes)) == (participant, nodes)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_list_or_refused(payload):
    try:
        decode_nodes(TYPE, bytes.fromhex("00010000") + payload)
    except MalformedMessage:
        return


@pytest.mark.parametrize(
    ("namespace", "name"), [("/", "a b"), ("left", "a"), ("/", ""), ("/", "\x1b[31m"), ("/*", "a")]
)
def test_impossible_node_is_refused_and_escaped(namespace, name):
    payload = encode_nodes(TYPE, bytes(16), [ListedNode(namespace, name)])
    with pytest.raises(MalformedMessage) as error:
        decode_nodes(TYPE, payload)
    assert "\x1b" not in str(error.value)


def test_too_many_nodes_are_refused():
    payload = encode_nodes(TYPE, bytes(16), [ListedNode("/", "a")] * 1001)
    with pytest.raises(MalformedMessage, match="1001 nodes"):
        decode_nodes(TYPE, payload)
