"""RunQuestions: what pages may ask about one run, and the answers that they follow, each made once for all pages."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow.clock import SystemClock
from busflow.commands import kept_lines, plugin_places, problems_in
from busflow.errors import BusflowError
from busflow_ui.questions import arguments as checked
from busflow_ui.questions import frames
from busflow_ui.questions.allowance import Allowance
from busflow_ui.questions.assistant_questions import AssistantQuestions
from busflow_ui.questions.cited_pages import NoChapters
from busflow_ui.questions.followed import Changed, NewLines
from busflow_ui.questions.graph_answer import Moment, graph_answer
from busflow_ui.questions.heartbeat import Heartbeat
from busflow_ui.questions.last_errors import LastErrors
from busflow_ui.questions.page_goals import PageGoals
from busflow_ui.questions.page_recorder import PageRecorder
from busflow_ui.questions.session import AnswerInParts, AskingOnly, Question, Session, mistake
from busflow_ui.questions.steering import Steering

if TYPE_CHECKING:
    from busflow.errors import Problem
    from busflow_ui.foxglove.bridge import Bridge
    from busflow_ui.foxglove.viewer import Viewer
    from busflow_ui.questions.cited_pages import Chapters

_MOST_LINES = 1000
_RUN_WORDS = ("name", "file", "since_ns", "seed", "clock", "version")
_RATED_S = 0.9
"""Shortest time over which a rate is counted: a page that comes has the graph read at once, between two looks."""
_SMOOTH_S = 3.0
"""Time over which it is counted where the graph was seen that long ago."""
QUESTIONS_A_MINUTE = 20
"""To the assistant, from one page that may only look."""
QUESTIONS_OF_OTHERS = 60
"""To the assistant, from all pages of other sites together."""
_TOO_LONG_S = 5.0
_HEALTH_EVERY = 3
"""Looks at the graph for each look at what is wrong, which asks more."""


class RunQuestions:
    """Questions about one run, from its beginning to its end."""

    def __init__(
        self, bridge: Bridge, *, print_message: Callable[[str], None], chapters: Chapters | None = None
    ) -> None:
        self._bridge, self._print = bridge, print_message
        self._assistant = AssistantQuestions(bridge, chapters or NoChapters())
        self._sessions: set[Session] = set()
        self._clock = SystemClock()
        self._moments: deque[Moment] = deque()
        """What was seen lately, the oldest first: rates are counted from it on."""
        self._run_row: dict[str, Any] = {}
        self._silent_s: float | None = None
        self._places: Mapping[str, str] | None = None
        self._reading_places = asyncio.Lock()
        self._mistakes: set[str] = set()
        """Followed questions that failed by a bug in busflow; each is reported once."""
        self._recorder = PageRecorder(bridge.peer)
        self._errors = LastErrors(bridge)
        self._shared = Allowance(QUESTIONS_OF_OTHERS)
        """Of all pages together that may only ask: one page could connect often."""
        self._heartbeat = Heartbeat(bridge.peer, lambda: bool(self._sessions), self._on_silence)
        steering = Steering(bridge.peer, bridge.ask, bridge.call)
        self._questions: Mapping[str, Question] = {
            "graph": Question(self._graph, remaining=Changed),
            "log": Question(self._log, remaining=NewLines),
            "run": Question(self._run, remaining=Changed),
            "health": Question(self._health, remaining=Changed, every=_HEALTH_EVERY),
            "parameters": Question(steering.parameters),
            "layout": Question(steering.layout),
            "set_parameters": Question(self._then_send_parameters(steering), changes=_always),
            "save_parameters": Question(steering.save_parameters, changes=_always),
            "save_layout": Question(steering.save_layout, changes=_always),
            "order": Question(steering.order, changes=_always),
            "log_level": Question(steering.log_level, changes=_always),
            "record": Question(self._record, remaining=Changed, changes=lambda arguments: "on" in arguments),
            "assistant": Question(self._assistant.state, remaining=Changed),
        }

    def session(self, viewer: Viewer) -> Session:
        """Begin the conversation with a page."""
        goals = PageGoals(self._bridge)
        own = {
            "action": Question(goals.types),
            "send_goal": _in_parts(goals.send, changes=_always),
            "cancel_goal": Question(goals.cancel, changes=_always),
            "ask_assistant": self._asking(Allowance(QUESTIONS_A_MINUTE) if viewer.read_only else None),
        }
        return self._begin(viewer, {**self._questions, **own}, goals.close)

    def asking_session(self, viewer: Viewer) -> AskingOnly:
        """Begin the conversation with a page that may ask the assistant, and nothing else."""
        questions = {"assistant": self._questions["assistant"], "ask_assistant": self._asking(self._shared)}
        return AskingOnly(self._begin(viewer, questions))

    def _asking(self, allowance: Allowance | None) -> Question:
        return _in_parts(lambda arguments, send_part: self._assistant.ask(arguments, send_part, allowance))

    def _begin(
        self, viewer: Viewer, questions: Mapping[str, Question], close: Callable[[], object] = lambda: None
    ) -> Session:
        def on_close(session: Session) -> None:
            self._sessions.discard(session)
            close()

        session = Session(
            questions, viewer.send, read_only=viewer.read_only, print_message=self._print, on_close=on_close
        )
        self._sessions.add(session)
        return session

    async def keep(self) -> None:
        """Send what pages follow with each look at the graph, and watch that the run answers, until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._heartbeat.keep())
            tasks.create_task(self._keep_sending())

    def send_all(self, question: str, found: object) -> None:
        """Send every page an answer, whether it follows the question or not."""
        for session in self._sessions:
            session.send(frames.update(question, found))

    def ended_run(self) -> dict[str, object]:
        """Return what is known of a run that has ended, in the form of `run`: its exit code and report are not."""
        bridge = self._bridge
        ended: dict[str, object] = {"was_killed": bridge.was_killed, "errors": self._errors.recent()}
        if self._sessions:  # else the graph is as old as the last page
            ended["elapsed_s"] = max((each["elapsed_s"] for each in bridge.graph.processes), default=None)
            ended["seen_s"] = round(self._clock.seconds() - bridge.looked_s, 1)
        return {**self._run_row, "name": bridge.peer.run.name, "ended": ended}

    def close(self) -> None:
        """End the recording, and ask no more."""
        self._assistant.close()
        self._heartbeat.close()
        self._errors.close()
        with suppress(BusflowError):
            self._recorder.close()

    async def _keep_sending(self) -> None:
        looks = 0
        while True:
            await self._bridge.next_look()
            looks += 1
            await self._bridge.ask(self._recorder.follow)
            await self._bridge.ask(self._errors.follow)
            for name in sorted({name for each in self._sessions for name in each.following}):
                if looks % self._questions[name].every == 0:
                    await self._send_followed(name)

    async def _send_followed(self, name: str) -> None:
        try:
            found = await self._questions[name].answer({})
        except BusflowError:
            return  # the bridge says that the run is silent
        except Exception as error:  # noqa: BLE001  # the next look may succeed, and the other answers go on
            if name not in self._mistakes:
                self._print(mistake(name, error))
            self._mistakes.add(name)
            return
        for session in self._sessions:
            session.send_update(name, found)

    def _on_silence(self, silent_s: float | None) -> None:
        self._silent_s = silent_s
        self.send_all("run", self._run_now())

    # Answers.

    async def _run(self, _arguments: Mapping[str, Any]) -> object:
        answers: Sequence[Mapping[str, Any]] = await self._bridge.ask(self._bridge.peer.ask, "run")
        main = next((each for each in answers if each["process"] == "main"), answers[0])
        self._run_row = {word: main[word] for word in _RUN_WORDS}
        return self._run_now()

    def _run_now(self) -> dict[str, object]:
        row: dict[str, object] = {**self._run_row, "name": self._bridge.peer.run.name}
        return row if self._silent_s is None else {**row, "silent_s": self._silent_s}

    async def _graph(self, _arguments: Mapping[str, Any]) -> object:
        async with self._reading_places:
            places = self._places
            if places is None:
                places = self._places = await self._bridge.call(self._read_places)
        now = Moment(self._bridge.graph, self._bridge.looked_s)  # read each second while a viewer is connected
        moments = self._moments
        while moments and now.at_s - moments[0].at_s > _TOO_LONG_S:
            moments.popleft()
        while len(moments) > 1 and now.at_s - moments[1].at_s >= _SMOOTH_S:
            moments.popleft()
        before = moments[0] if moments and now.at_s - moments[0].at_s >= _RATED_S else None
        if not moments or now.at_s > moments[-1].at_s:
            moments.append(now)
        return graph_answer(now, before, places)

    def _read_places(self) -> Mapping[str, str]:
        """Return where each node's class is; nothing where the launch file is gone, or on another machine."""
        try:
            return plugin_places(Path(self._bridge.peer.run.card.file))
        except (BusflowError, OSError):
            return {}

    async def _log(self, arguments: Mapping[str, Any]) -> object:
        count = checked.whole_number(arguments, "count", least=1, most=_MOST_LINES, default=_MOST_LINES)
        return {"lines": await self._bridge.ask(kept_lines, self._bridge.peer, count)}

    async def _health(self, _arguments: Mapping[str, Any]) -> object:
        found: Sequence[Problem] = await self._bridge.ask(problems_in, self._bridge.peer)
        return {"findings": [each.as_json() for each in found]}

    async def _record(self, arguments: Mapping[str, Any]) -> object:
        if "on" not in arguments:
            return self._recorder.state()
        is_on = checked.flag(arguments, "on")
        state = await self._bridge.ask(lambda: self._recorder.switch(on=is_on))
        for session in self._sessions:
            session.send_update("record", state)
        return state

    def _then_send_parameters(self, steering: Steering) -> Callable[[Mapping[str, Any]], Any]:
        async def set_parameters(arguments: Mapping[str, Any]) -> object:
            answer = await steering.set_parameters(arguments)
            await self._bridge.send_parameters()
            return answer

        return set_parameters


def _always(_arguments: Mapping[str, Any]) -> bool:
    return True


def _in_parts(
    answer: AnswerInParts, *, changes: Callable[[Mapping[str, Any]], bool] = lambda _arguments: False
) -> Question:
    return Question(lambda arguments: answer(arguments, lambda _part: None), in_parts=answer, changes=changes)
