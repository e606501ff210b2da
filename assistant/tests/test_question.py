"""What a question asks for."""

import pytest

from busflow_assistant.answer_kinds import AnswerKind
from busflow_assistant.question import parts, understand
from busflow_assistant.words import stem, terms_of


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("How often does it publish?", AnswerKind.RATE),
        ("how long may it be silent", AnswerKind.DURATION),
        ("How many viewers can connect?", AnswerKind.COUNT),
        ("what is the mass of the arm", AnswerKind.AMOUNT),
        ("how many viewers may connect at most", AnswerKind.LIMIT),
        ("Which version of Python is needed?", AnswerKind.VERSION),
        ("what is the default depth?", AnswerKind.DEFAULT),
        ("Which topics are there?", AnswerKind.LIST),
        ("why is it refused", AnswerKind.REASON),
        ("how do I rename a topic", AnswerKind.METHOD),
        ("What is a node?", AnswerKind.DEFINITION),
        ("What does the processor do?", AnswerKind.FUNCTION),
        ("difference between a topic and a service", AnswerKind.DIFFERENCE),
        ("Wie oft wird gesendet?", AnswerKind.RATE),
        ("¿Por qué falla el nodo?", AnswerKind.REASON),
    ],
)
def test_kind_of_answer_is_recognised(text, kind):
    assert kind in understand(text).wanted


def test_question_for_a_way_asks_for_no_rate():
    assert AnswerKind.RATE not in understand("How do I set the rate of the sensors?").wanted


def test_words_of_any_subject_weigh_less():
    weights = {term.word: term.weight for term in understand("which value can the overflow setting rate_hz have").terms}
    assert weights["value"] < weights["overflow"] < weights["rate_hz"]
    assert "which" not in weights


def test_question_in_german_is_looked_for_in_english():
    question = understand("Wie oft sendet der Knoten eine Nachricht?")
    assert question.spoken == "german"
    assert {"node", "messag"} <= {one for term in question.terms for one in term.stems}


def test_several_sentences_are_parts():
    assert parts("What is it? And why?") == ["What is it?", "And why?"]
    assert parts("What is it?") == []


def test_identifier_is_found_by_its_parts():
    assert terms_of("sensor_processor") == ("sensor_processor", "sensor", "processor")
    assert terms_of("QoS") == ("qos",)
    assert stem("written") == stem("write")
    assert stem("slowly") == stem("slow")
