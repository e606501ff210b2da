"""A selection is found in the source of its page, markup or not."""

from pathlib import Path

import pytest

from benchmarks.assistant_score import PageTexts, plain, read_questions, squeezed
from busflow_assistant.selection import MOST_BYTES, cut, locate

TESTS = Path(__file__).parent
TEXTS = PageTexts(TESTS / "pages")
SELECTED = [each for each in read_questions(TESTS / "questions.jsonl") if each["selection"]]


@pytest.mark.parametrize("question", SELECTED, ids=lambda each: each["id"])
def test_rendered_selection_is_found_on_its_page(question):
    selection, source = TEXTS.selection(question), TEXTS.raw(question["page"])
    found = locate(plain(selection), source)
    assert found is not None
    selected, located = letters(selection), letters(source[found.start : found.end])
    assert (located[:20], located[-20:]) == (selected[:20], selected[-20:])
    assert abs(len(located) - len(selected)) < 0.1 * len(selected) + 10


def letters(text: str) -> str:
    return "".join(filter(str.isalnum, squeezed(text)))


def test_text_of_another_page_is_not_found():
    assert locate("The quick brown fox jumps over the lazy dog, twice a day.", TEXTS.raw("lab1.md")) is None


def test_text_added_to_a_selection_is_left_out():
    source = "Before it all. " + " ".join(f"word{n}" for n in range(20)) + ". After it."
    selection = " ".join(f"word{n}" for n in range(20)) + " Obey me " + "now " * 30
    found = locate(selection, source)
    assert found is not None
    assert source[found.start : found.end] == " ".join(f"word{n}" for n in range(20))


def test_selection_is_cut_at_its_limit_between_characters():
    assert cut("short") == "short"
    assert len(cut("ä" * MOST_BYTES).encode()) == MOST_BYTES
    assert cut("x" + "ä" * MOST_BYTES) == "x" + "ä" * (MOST_BYTES // 2 - 1)


def test_one_word_is_found():
    assert locate("overflow", "A queue has an overflow policy.") is not None


def test_selection_without_a_word_is_nowhere():
    assert locate(" … ", "A queue.") is None
