"""An answer, its citations, and the reasons of a refusal."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from busflow_assistant.passages import Extent


class AnswerScope(StrEnum):
    """Where an answer comes from."""

    SELECTION = "selection"
    PAGE = "page"


class Reason(StrEnum):
    """Why a question was refused."""

    EMPTY = "empty"
    """There is no text to answer from."""
    NO_QUESTION = "no_question"
    OFF_TOPIC = "off_topic"
    """Nothing of the question is in the text."""
    NOT_SAID = "not_said"
    """The text speaks of the subject, and does not say what was asked."""
    ORDER = "order"
    """The question is an order to the assistant."""
    UNKNOWN_PAGE = "unknown_page"


@dataclass(frozen=True, slots=True)
class Citation:
    """A verbatim part of a page, or, with an empty page, of the selection."""

    page: str
    span: Extent
    text: str
    score: float


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer from the text, or a refusal in words."""

    text: str
    citations: tuple[Citation, ...] = ()
    scope: AnswerScope = AnswerScope.PAGE
    reason: Reason | None = None

    @property
    def answered(self) -> bool:
        """Whether it is no refusal."""
        return self.reason is None
