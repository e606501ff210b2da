"""A model's pieces become whole sentences, and only supported ones."""

from hypothesis import given
from hypothesis import strategies as st

from busflow_assistant.grounding import Grounding
from busflow_assistant.support import Unsupported

TEXT = "A pump moves water. It runs at 20 Hz."


def test_sentence_is_shown_when_it_is_whole():
    grounding = Grounding(TEXT)
    assert grounding.take("A pump moves ") == []
    assert grounding.take("water. It ru") == ["A pump moves water."]
    assert grounding.take("ns at 30 Hz.") == []
    assert grounding.finish() == []
    assert grounding.withheld == [("It runs at 30 Hz.", Unsupported.NUMBER)]
    assert grounding.shown == ["A pump moves water."]


@given(st.lists(st.integers(1, 12), max_size=12))
def test_pieces_of_any_length_give_the_same(lengths):
    grounding, rest = Grounding(TEXT), TEXT
    for length in lengths:
        grounding.take(rest[:length])
        rest = rest[length:]
    grounding.take(rest)
    grounding.finish()
    assert grounding.shown == ["A pump moves water.", "It runs at 20 Hz."]
