"""RunQuestions: what pages may ask about one run, and the answers that they follow, each made once for all pages."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

from busflow.cli.commands import kept_lines
from busflow.clock import SystemClock
from busflow.errors import BusflowError, MalformedMessage, NoSuchTarget
from busflow.text import printable
from busflow_ui.questions import frames
from busflow_ui.questions.followed import Changed, NewLines
from busflow_ui.questions.graph_answer import Look, graph_answer
from busflow_ui.questions.session import Question, Session

if TYPE_CHECKING:
    from busflow_ui.foxglove.bridge import Bridge
    from busflow_ui.foxglove.viewer import Viewer

_MOST_LINES = 1000


class RunQuestions:
    """Questions about one run, from its beginning to its end."""

    def __init__(self, bridge: Bridge, *, print_message: Callable[[str], None]) -> None:
        self._bridge, self._print = bridge, print_message
        self._clock = SystemClock()
        self._sessions: set[Session] = set()
        self._look: Look | None = None
        self._earlier: Look | None = None
        self._questions: Mapping[str, Question] = {
            "graph": Question(self._graph, remaining=Changed),
            "log": Question(self._log, remaining=NewLines),
            "run": Question(self._run, remaining=Changed),
            "parameters": Question(self._parameters),
            "set_parameters": Question(self._set_parameters, changes=True),
        }

    def session(self, viewer: Viewer) -> Session:
        """Begin the conversation with a page."""
        session = Session(
            self._questions,
            viewer.send,
            read_only=viewer.read_only,
            print_message=self._print,
            on_close=self._sessions.discard,
        )
        self._sessions.add(session)
        return session

    async def keep(self) -> None:
        """Send what pages follow with each look at the graph, where it has changed, until cancelled."""
        while True:
            await self._bridge.next_look()
            for name in sorted({name for each in self._sessions for name in each.following}):
                try:
                    found = await self._questions[name].answer({})
                except BusflowError:
                    continue  # the bridge says that the run is silent
                for session in self._sessions:
                    session.send_update(name, found)

    def send_all(self, question: str, found: object) -> None:
        """Send every page an answer, whether it follows the question or not."""
        for session in self._sessions:
            session.send(frames.update(question, found))

    def last_words(self) -> dict[str, object]:
        """Return what is known of a run that has ended."""
        processes = self._bridge.graph.processes
        return {"exit_code": None, "elapsed_s": max((each["elapsed_s"] for each in processes), default=None)}

    # The run.

    async def _run(self, _arguments: Mapping[str, Any]) -> object:
        answers: Sequence[Mapping[str, Any]] = await self._bridge.ask(self._bridge.peer.ask, "run")
        main = next((each for each in answers if each["process"] == "main"), answers[0])
        return {word: main[word] for word in ("name", "file", "since_ns", "seed", "clock", "version")}

    async def _graph(self, _arguments: Mapping[str, Any]) -> object:
        seen = self._bridge.graph  # read each second while a viewer is connected
        if self._look is None or seen is not self._look.graph:
            self._earlier, self._look = self._look, Look(seen, self._clock.seconds())
        return graph_answer(self._look, self._earlier, {})

    async def _log(self, arguments: Mapping[str, Any]) -> object:
        count = arguments.get("count", _MOST_LINES)
        if type(count) is not int or not 0 < count <= _MOST_LINES:
            raise MalformedMessage(f"count is a number from 1 to {_MOST_LINES}")
        return {"lines": await self._bridge.ask(kept_lines, self._bridge.peer, count)}

    # Parameters.

    async def _parameters(self, arguments: Mapping[str, Any]) -> object:
        node = _text(arguments, "node")
        for answer in await self._bridge.ask(lambda: self._bridge.peer.ask("parameters", node=node)):
            if node in answer:
                return {"node": node, "parameters": answer[node]}
        raise NoSuchTarget(f"{printable(node, limit=200)} has no parameters of busflow's")

    async def _set_parameters(self, arguments: Mapping[str, Any]) -> object:
        node, values = _text(arguments, "node"), arguments.get("values")
        if not isinstance(values, dict):
            raise MalformedMessage("values is an object")
        peer, wanted = self._bridge.peer, cast("dict[str, Any]", values)
        (answer,) = await self._bridge.ask(lambda: peer.ask("set_parameters", node=node, values=wanted))
        await self._bridge.send_parameters()
        return answer


def _text(arguments: Mapping[str, Any], word: str) -> str:
    found = arguments.get(word)
    if not isinstance(found, str):
        raise MalformedMessage(f"{word} is text")
    return found
