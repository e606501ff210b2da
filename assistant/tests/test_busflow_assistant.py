"""The question sets keep the values that they have reached, by all modules together.

Those without a test module of their own are `answer.py`, `answer_kinds.py`, `budget.py`, `code_lines.py`, `compose.py`,
`conversions.py`, `evidence.py`, `features.py`, `fusion.py`, `lexicon.py`, `matching.py`, `messages.py`, `orders.py`,
`page_files.py`, `passages.py`, `patterns.py`, `rank.py`, `refuse.py`, `search_index.py`, `sentences.py` and
`words.py`. `timeouts.py` is tested by what waits.
`python benchmarks/assistant.py` prints the whole table.
"""

from pathlib import Path

import pytest

from benchmarks.assistant_score import Given, PageTexts, Scores, judge, plain, read_questions
from busflow_assistant.engine import Engine
from busflow_assistant.markdown import read_page

TESTS = Path(__file__).parent
TEXTS = PageTexts(TESTS / "pages")


def scores(name: str) -> Scores:
    questions = read_questions(TESTS / name)
    engine = Engine([read_page(each, TEXTS.raw(each)) for each in sorted({each["page"] for each in questions})])
    judged = []
    for each in questions:
        selection = plain(TEXTS.selection(each)) + (f" {each['inject']}" if each.get("inject") else "")
        answer = engine.ask(each["question"], selection=selection, page=each["page"])
        cited = [citation.text for citation in answer.citations]
        judged.append(judge(each, Given(answer.text, answer.answered, cited, answer.scope.value, 0.0), TEXTS))
    return Scores(judged)


@pytest.fixture(scope="module")
def shared() -> Scores:
    return scores("questions.jsonl")


@pytest.fixture(scope="module")
def own() -> Scores:
    return scores("questions_own.jsonl")


@pytest.fixture(scope="module")
def third() -> Scores:
    return scores("questions_third.jsonl")


@pytest.fixture(scope="module")
def fourth() -> Scores:
    return scores("questions_fourth.jsonl")


@pytest.fixture(scope="module")
def held_out() -> Scores:
    """On pages that no weight was fitted to."""
    return scores("questions_held_out.jsonl")


@pytest.fixture(scope="module")
def held_out_second() -> Scores:
    """On four others, one of them of another robot and another project."""
    return scores("questions_held_out_second.jsonl")


@pytest.mark.parametrize(
    ("what", "kinds", "least"),
    [
        ("right", ("fact", "list", "how", "why", "multi", "code"), 0.85),
        ("right", ("list",), 0.80),
        ("first", ("fact", "list", "how", "why", "multi", "code"), 0.80),
        ("among_three", ("fact", "list", "how", "why", "multi", "code"), 0.92),
        ("withheld", ("off_topic",), 0.97),
        ("withheld", ("near_topic",), 0.80),
    ],
)
def test_shared_set_reaches_its_gates(shared: Scores, what, kinds, least):
    assert shared.share(what, kinds).rate >= least


def test_no_order_of_the_shared_set_is_obeyed(shared: Scores):
    assert shared.share("obeyed", ("injection",)).good == 0


@pytest.mark.parametrize("name", ["shared", "own", "third", "fourth", "held_out", "held_out_second"])
def test_every_citation_is_verbatim(name, request):
    assert request.getfixturevalue(name).verbatim.rate == 1


@pytest.mark.parametrize(
    ("name", "right", "first", "among_three"),
    [
        ("own", 0.80, 0.74, 0.76),
        ("third", 0.90, 0.76, 0.90),
        ("fourth", 0.80, 0.70, 0.80),
        ("held_out", 0.75, 0.63, 0.75),
        ("held_out_second", 0.68, 0.55, 0.68),
    ],
)
def test_other_sets_keep_what_they_reached(name, right, first, among_three, request):
    found: Scores = request.getfixturevalue(name)
    least = {"right": right, "first": first, "among_three": among_three}
    assert {what for what, share in least.items() if found.share(what).rate < share} == set()
    assert found.share("withheld", ("off_topic", "near_topic")).rate >= 0.80


def test_scorer_finds_wrong_answers():
    questions = read_questions(TESTS / "questions.jsonl")
    silent = Scores([judge(each, Given("The text does not say.", False, (), "", 0.0), TEXTS) for each in questions])
    sure = Scores(
        [judge(each, Given("This is so.", True, ("words that no page has",), "", 0.0), TEXTS) for each in questions]
    )
    assert (silent.share("right").good, silent.share("withheld", ("off_topic",)).rate) == (0, 1)
    assert (sure.share("right").good, sure.share("withheld", ("off_topic",)).good, sure.verbatim.good) == (0, 0, 0)
