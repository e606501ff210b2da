"""The node that answers questions about the pages."""

from __future__ import annotations

import asyncio
import os
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import Field

from busflow import TRANSIENT_LOCAL, Node, Parameters, publisher, service, subscription
from busflow_assistant import timeouts
from busflow_assistant.answer import Answer
from busflow_assistant.budget import HourlyBudget
from busflow_assistant.conversions import citation_to_message, page_from_message
from busflow_assistant.engine import Engine, Reorder
from busflow_assistant.grounding import Grounding
from busflow_assistant.messages import AnswerPart, AskText, AssistantState, Exchange, Index
from busflow_assistant.models import EmbedderParameters, EndpointParameters
from busflow_assistant.selection import cut

if TYPE_CHECKING:
    from busflow_assistant.model_server import ModelServer  # httpx is of the extra

EXTRACTIVE = "extractive"
WITH_EMBEDDINGS = "extractive+embeddings"


class AssistantParameters(Parameters):
    """What the assistant keeps, and which models it may use."""

    keep_questions: bool = Field(default=False, description="Publish each question with its answer on assistant/log.")
    embedder: EmbedderParameters = EmbedderParameters()
    endpoint: EndpointParameters = EndpointParameters()


class Assistant(Node):
    """Answers questions about a selection or a page with verbatim sentences, or says that the text has no answer."""

    parameters: AssistantParameters

    tokens = publisher(AnswerPart, "assistant/tokens")
    exchanges = publisher(Exchange, "assistant/log")
    state = publisher(AssistantState, "assistant/state", qos=TRANSIENT_LOCAL)

    async def start(self) -> None:
        """Load the models that are wanted; the pages come with the index."""
        self.engine = Engine(())
        self.pages_read = asyncio.Event()
        self.started_s = self.clock.seconds()
        self.asked = 0
        self.server: ModelServer | None = None
        self.budget = HourlyBudget(self.parameters.endpoint.requests_per_hour)
        self.reorder: Reorder | None = None
        if self.parameters.embedder.model_dir:
            self.reorder = await self.run_sync(load_embedder, Path(self.parameters.embedder.model_dir))
        if self.parameters.endpoint.url:
            self.server = connect(self.parameters.endpoint)
        self.publish_state(0)

    async def stop(self) -> None:
        """Close the connection to the server."""
        if self.server is not None:
            await self.server.close()

    @property
    def engine_name(self) -> str:
        """The name of the engine that answers without a server."""
        return WITH_EMBEDDINGS if self.reorder is not None else EXTRACTIVE

    @subscription("assistant/index", qos=TRANSIENT_LOCAL)
    async def on_index(self, index: Index) -> None:
        """Index the pages anew."""
        reorder = self.reorder
        self.engine = await self.run_sync(lambda: Engine(map(page_from_message, index.pages), reorder))
        self.pages_read.set()
        self.publish_state(len(index.pages))

    def publish_state(self, pages: int) -> None:
        """Publish the engine that answers, and where questions go."""
        host = self.server.address.host if self.server is not None else ""
        model = self.server.address.model if self.server is not None else ""
        self.state.publish(AssistantState(pages=pages, engine=self.engine_name, host=host, model=model))

    @service(AskText, "assistant/ask")
    async def ask(self, request: AskText.Request) -> AskText.Response:
        """Answer a question."""
        if not request.selection:
            await self.until_pages_are_read()
        began_s = self.clock.seconds()
        self.asked += 1
        stream = PartStream(self, request.id or f"{self.name}-{self.asked}")
        engine = self.engine
        answer = await self.run_sync(
            lambda: engine.ask(request.question, selection=request.selection, page=request.page)
        )
        written = await self.write(request.question, answer, stream)
        stream.end("" if written else answer.text)
        response = AskText.Response(
            id=stream.id,
            answer=written or answer.text,
            answered=answer.answered,
            scope=answer.scope.value if answer.answered else "",
            reason=answer.reason.value if answer.reason else "",
            citations=[citation_to_message(each) for each in answer.citations],
            engine=self.server_name if written else self.engine_name,
            ms=round(1000 * (self.clock.seconds() - began_s), 3),
        )
        if self.parameters.keep_questions:
            self.keep(request, response)
        return response

    async def until_pages_are_read(self) -> None:
        """Wait for the pages, which arrive some moments after the start."""
        left_s = self.started_s + timeouts.current.reading - self.clock.seconds()
        with suppress(TimeoutError):
            async with asyncio.timeout(max(0.0, left_s)):
                await self.pages_read.wait()

    @property
    def server_name(self) -> str:
        """The model with its host."""
        return f"{self.server.address.model} at {self.server.address.host}" if self.server is not None else ""

    async def write(self, question: str, answer: Answer, stream: PartStream) -> str:
        """Return what a server's model says, as far as the citations support it; nothing where that is not possible.

        What the page does not answer is not sent.
        """
        if self.server is None or not answer.answered or not self.budget.take(self.clock.seconds()):
            return ""
        from busflow_assistant.model_server import ServerFault

        cited = [each.text for each in answer.citations]
        grounding = Grounding("\n".join(cited))
        try:
            async with asyncio.timeout(self.server.address.timeout_s):
                async for piece in self.server.answer(question, cited):
                    stream.add(grounding.take(piece))
                stream.add(grounding.finish())
        except (ServerFault, TimeoutError) as fault:
            reason = str(fault) or f"no whole answer within {self.server.address.timeout_s:g} s"
            self.log.warning("answered without the model", reason=reason)
        if grounding.withheld:
            self.log.info("not shown: the page does not support it", sentences=len(grounding.withheld))
        return " ".join(grounding.shown)

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


class PartStream:
    """The parts of one answer on `assistant/tokens`, numbered from 0."""

    def __init__(self, node: Assistant, name: str) -> None:
        self.id = name
        self._publisher = node.tokens
        self._number = 0

    def add(self, sentences: list[str]) -> None:
        """Publish sentences that may be shown."""
        for sentence in sentences:
            self._publish(sentence if self._number == 0 else f" {sentence}")

    def end(self, text: str) -> None:
        """Publish what is left line by line, and the part that says that it was the last."""
        for line in text.splitlines(keepends=True):
            self._publish(line)
        self._publish("", last=True)

    def _publish(self, text: str, *, last: bool = False) -> None:
        self._publisher.publish(AnswerPart(id=self.id, number=self._number, text=text, last=last))
        self._number += 1


def load_embedder(folder: Path) -> Reorder:
    """Return a function that orders units by a sentence model too."""
    from busflow_assistant.embedder import Embedder  # of the extra
    from busflow_assistant.fusion import Fusion

    return Fusion(Embedder(folder)).fused


def connect(endpoint: EndpointParameters) -> ModelServer:
    """Return the server of an endpoint, with its key from the environment."""
    from busflow_assistant.model_server import ModelServer, ServerAddress  # httpx is of the extra

    key = os.environ.get(endpoint.api_key_env, "") if endpoint.api_key_env else ""
    return ModelServer(
        ServerAddress(endpoint.url, endpoint.model, key, timeout_s=endpoint.timeout_s, max_tokens=endpoint.max_tokens)
    )
