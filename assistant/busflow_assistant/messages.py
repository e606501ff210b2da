"""The assistant's own message and service types, in the package `busflow_assistant`.

Offsets are characters (code points) of a page's Markdown source, the end not included.
"""

from __future__ import annotations

from collections.abc import Sequence

from busflow import Message, ServiceType
from busflow.interfaces.message import UInt32Array, uint32, zeros
from busflow.msgs.builtin_interfaces import Time


class IndexedPassage(Message, package="busflow_assistant"):
    """A paragraph, list, table, heading or block of code of a page."""

    shape: str = ""
    """`heading`, `prose`, `list`, `table` or `code`."""
    headings: Sequence[str] = ()
    """The headings above it, from the page's title down."""
    start: uint32 = 0
    end: uint32 = 0
    starts: UInt32Array = zeros()
    """Where each sentence, item, row or line of it starts."""
    ends: UInt32Array = zeros()


class IndexedPage(Message, package="busflow_assistant"):
    """A page with its passages."""

    name: str = ""
    title: str = ""
    source: str = ""
    """The Markdown, to which all offsets count."""
    passages: Sequence[IndexedPassage] = ()


class Index(Message, package="busflow_assistant"):
    """The pages that the assistant answers from, on `assistant/index`, anew when a file changes."""

    stamp: Time = Time()
    pages: Sequence[IndexedPage] = ()
    left_out: Sequence[str] = ()
    """Files that are no page, each with the reason: too large, not UTF-8, unreadable."""


class CitedText(Message, package="busflow_assistant"):
    """A verbatim part of a page, by which an answer is supported."""

    page: str = ""
    """The page's name; empty for text of the selection that no page has, whose offsets count in the selection."""
    start: uint32 = 0
    end: uint32 = 0
    text: str = ""
    score: float = 0.0
    """How well it answers, to compare the citations of one answer."""


class AskText(ServiceType, package="busflow_assistant"):
    """Asks a question about a selection, a page or, without both, all pages."""

    class Request(Message):
        """A question."""

        question: str = ""
        selection: str = ""
        """Text that the reader selected; of more than 20 kB the first are taken."""
        page: str = ""
        """The name of the page that is open."""
        id: str = ""
        """What the parts on `assistant/tokens` are known by; without one the assistant makes one."""

    class Response(Message):
        """An answer of verbatim sentences, or a refusal in words."""

        id: str = ""
        answer: str = ""
        answered: bool = False
        scope: str = ""
        """Where the answer comes from: `selection` or `page`."""
        reason: str = ""
        """Of a refusal: `empty`, `no_question`, `off_topic`, `not_said`, `order`, `unknown_page`."""
        citations: Sequence[CitedText] = ()
        engine: str = ""
        """`extractive`, `extractive+embeddings`, or the model's name with its host."""
        ms: float = 0.0
        """How long it took, by the run's clock."""


class AssistantState(Message, package="busflow_assistant"):
    """What answers, on `assistant/state`: published at the start, and when the pages were read anew."""

    pages: uint32 = 0
    engine: str = ""
    host: str = ""
    """The host that questions are sent to; empty where nothing leaves the machine."""
    model: str = ""


class AnswerPart(Message, package="busflow_assistant"):
    """A part of an answer as it comes, on `assistant/tokens`."""

    id: str = ""
    number: uint32 = 0
    """From 0, without a gap."""
    text: str = ""
    last: bool = False


class Exchange(Message, package="busflow_assistant"):
    """A question with its answer, on `assistant/log` where `keep_questions` is on."""

    stamp: Time = Time()
    question: str = ""
    selection: str = ""
    page: str = ""
    answer: str = ""
    answered: bool = False
    scope: str = ""
    reason: str = ""
    citations: Sequence[CitedText] = ()
    engine: str = ""
