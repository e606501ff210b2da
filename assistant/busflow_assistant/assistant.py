"""The node that answers questions about the pages."""

from __future__ import annotations

import asyncio

from pydantic import Field

from busflow import TRANSIENT_LOCAL, Node, Parameters, publisher, service, subscription
from busflow_assistant.answer import Answer
from busflow_assistant.conversions import citation_to_message, page_from_message
from busflow_assistant.engine import Engine
from busflow_assistant.messages import AnswerPart, AskText, Exchange, Index
from busflow_assistant.selection import cut

ENGINE = "extractive"


class AssistantParameters(Parameters):
    """What the assistant keeps, and which models it may use."""

    keep_questions: bool = Field(default=False, description="Publish each question with its answer on assistant/log.")


class Assistant(Node):
    """Answers questions about a selection or a page with verbatim sentences, or says that the text has no answer."""

    parameters: AssistantParameters

    tokens = publisher(AnswerPart, "assistant/tokens")
    exchanges = publisher(Exchange, "assistant/log")

    async def start(self) -> None:
        """Begin without pages: they come with the index."""
        self.engine = Engine(())
        self.pages_read = asyncio.Event()
        self.asked = 0

    @subscription("assistant/index", qos=TRANSIENT_LOCAL)
    async def on_index(self, index: Index) -> None:
        """Index the pages anew."""
        self.engine = await self.run_sync(lambda: Engine(map(page_from_message, index.pages)))
        self.pages_read.set()

    @service(AskText, "assistant/ask")
    async def ask(self, request: AskText.Request) -> AskText.Response:
        """Answer a question."""
        began_s = self.clock.seconds()
        self.asked += 1
        name = request.id or f"{self.name}-{self.asked}"
        engine = self.engine
        answer = await self.run_sync(
            lambda: engine.ask(request.question, selection=request.selection, page=request.page)
        )
        self.stream(name, answer)
        response = AskText.Response(
            id=name,
            answer=answer.text,
            answered=answer.answered,
            scope=answer.scope.value if answer.answered else "",
            reason=answer.reason.value if answer.reason else "",
            citations=[citation_to_message(each) for each in answer.citations],
            engine=ENGINE,
            ms=round(1000 * (self.clock.seconds() - began_s), 3),
        )
        if self.parameters.keep_questions:
            self.keep(request, response)
        return response

    def stream(self, name: str, answer: Answer) -> None:
        """Publish an answer line by line, as a model's comes."""
        lines = answer.text.splitlines(keepends=True) or [""]
        for number, line in enumerate(lines):
            self.tokens.publish(AnswerPart(id=name, number=number, text=line, last=number == len(lines) - 1))

    def keep(self, request: AskText.Request, response: AskText.Response) -> None:
        """Publish a question with its answer, without the time it took: a replay compares these."""
        self.exchanges.publish(
            Exchange(
                stamp=self.clock.now().to_msg(),
                question=request.question,
                selection=cut(request.selection),
                page=request.page,
                answer=response.answer,
                answered=response.answered,
                scope=response.scope,
                reason=response.reason,
                citations=response.citations,
                engine=response.engine,
            )
        )
