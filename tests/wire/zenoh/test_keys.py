"""Keys, tokens and attachments as rmw_zenoh writes them."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.errors import MalformedMessage
from busflow.wire.zenoh.keys import Attachment, Token, TokenKind, topic_key

HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


def test_a_topic_key_holds_domain_topic_type_hash():
    assert topic_key("/imu/data", "sensor_msgs/msg/Imu", HASH, domain=7) == (
        f"7/imu/data/sensor_msgs::msg::dds_::Imu_/{HASH}"
    )


def test_token_of_a_node_is_rmw_zenohs():
    token = Token("aac3", 0, 0, TokenKind.NODE, "/", "talker")
    assert str(token) == "@ros2_lv/0/aac3/0/0/NN/%/%/talker"


def test_token_of_an_endpoint_is_rmw_zenohs():
    token = Token(
        "aac3",
        0,
        10,
        TokenKind.PUBLISHER,
        "/left",
        "talker",
        "/left/chatter",
        "std_msgs/msg/String",
        HASH,
        ":1:,7:,:,:,,",
    )
    assert str(token) == (
        f"@ros2_lv/0/aac3/0/10/MP/%/%left/talker/%left%chatter/std_msgs::msg::dds_::String_/{HASH}/:1:,7:,:,:,,"
    )
    assert token.node_name == "/left/talker"


words = st.from_regex(r"[a-z][a-z0-9_]{0,8}", fullmatch=True)
names = st.lists(words, min_size=1, max_size=3).map(lambda parts: "/" + "/".join(parts))


@given(
    st.builds(
        Token,
        session=st.from_regex(r"[0-9a-f]{1,32}", fullmatch=True),
        node_id=st.integers(0, 999),
        entity_id=st.integers(0, 999),
        kind=st.sampled_from([kind for kind in TokenKind if kind is not TokenKind.NODE]),
        namespace=names | st.just("/"),
        node=words,
        topic=names,
        type=st.tuples(words, st.sampled_from(["msg", "srv"]), words).map("/".join),
        hash=st.just(HASH),
        qos=st.just(":1:,7:,:,:,,"),
        enclave=names | st.just("/"),
        domain=st.integers(0, 232),
    )
)
def test_a_token_survives_the_round_trip(token):
    assert Token.parse(str(token)) == token


def test_a_newer_ross_extra_token_field_is_kept():
    token = Token("a", 0, 1, TokenKind.PUBLISHER, "/", "n", "/t", "p/msg/T", HASH, ":1:,7:,:,:,,")
    newer = Token.parse(f"{token}/backends:cpu")
    assert newer == replace(token, newer=("backends:cpu",))
    assert str(newer) == f"{token}/backends:cpu", "its gid is made of all of it"
    assert newer.gid != token.gid


@pytest.mark.parametrize(
    ("text", "gid"),
    [
        ("@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/talker", "34e0f0eaf0a5e0c897d90e747bb8850d"),
        (
            (
                "@ros2_lv/0/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/"
                "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18/::,7:,:,:,,"
            ),
            "eb85fa883b7846dc448a4501890ad062",
        ),
    ],
)
def test_gids_are_those_of_rmw_zenoh(text, gid):
    """The gids are what `simplified_XXH3_128bits` of rmw_zenoh_cpp 0.10.5 returns, compiled by itself."""
    assert Token.parse(text).gid.hex() == gid


@pytest.mark.parametrize(
    "text",
    ["", "@ros2_lv", "x/0/a/0/0/NN/%/%/n", "@ros2_lv/0/a/0/0/QQ/%/%/n", "@ros2_lv/0/a/x/0/NN/%/%/n",
     "@ros2_lv/0/a/0/1/MP/%/%/n/%t", "@ros2_lv/0/a/0/1/MP/%/%/n/%t/String/h/q"],
)  # fmt: skip
def test_an_invalid_token_is_refused_with_its_text(text):
    with pytest.raises(MalformedMessage) as caught:
        Token.parse(text)
    assert repr(text) in str(caught.value)


@pytest.mark.parametrize("field", ["namespace", "node", "topic", "type"])
def test_names_in_tokens_have_limited_length(field):
    names = {"namespace": "/n", "node": "n", "topic": "/t", "type": "p/msg/T"}
    names[field] += "x" * 255
    token = Token("a", 0, 1, TokenKind.PUBLISHER, hash="h", qos="q", **names)
    with pytest.raises(MalformedMessage, match=" 255 "):
        Token.parse(str(token))


def test_what_later_versions_append_may_be_longer():
    text = f"@ros2_lv/0/a/0/1/MP/%/%/n/%t/p::msg::dds_::T_/h/::,10:,:,:,,/backends:cuda:{'x' * 255}"
    assert str(Token.parse(text)) == text


def test_endpoints_have_gids_of_their_own():
    tokens = [Token("a", 0, entity, TokenKind.PUBLISHER, "/", "n", "/t", "p/msg/T", HASH, "") for entity in range(3)]
    assert len({token.gid for token in tokens}) == 3
    assert {len(token.gid) for token in tokens} == {16}


def test_an_attachment_is_33_bytes_as_in_zenoh():
    gid = bytes(range(16))
    data = Attachment(5, 6, gid).encode()
    assert data == bytes.fromhex("0500000000000000 0600000000000000 10") + gid
    assert Attachment.decode(data) == Attachment(5, 6, gid)


@given(st.binary(max_size=40))
def test_foreign_bytes_are_an_attachment_or_refused(data):
    try:
        found = Attachment.decode(data)
    except MalformedMessage:
        return
    assert found.encode() == data
