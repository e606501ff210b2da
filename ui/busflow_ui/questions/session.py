"""Session: one page's questions, each answered in a task of its own, and those that it follows."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from busflow.errors import BusflowError, MalformedMessage, NotAllowed
from busflow.text import did_you_mean, printable
from busflow_ui.questions import frames
from busflow_ui.questions.followed import Remaining

_MOST_ASKED = 16
"""Most questions of one page that are being answered; a further one is refused."""

Answer: TypeAlias = Callable[[Mapping[str, Any]], Awaitable[object]]
AnswerInParts: TypeAlias = Callable[[Mapping[str, Any], Callable[[object], None]], Awaitable[object]]
"""A function that also takes a function with which it sends parts of the answer."""


@dataclass(frozen=True, slots=True)
class Question:
    """Question that a page may ask."""

    answer: Answer
    in_parts: AnswerInParts | None = None
    """Answers, and sends parts of the answer before."""
    changes: Callable[[Mapping[str, Any]], bool] = lambda _arguments: False
    """Returns whether it changes the run or a file, which a page that may only look cannot."""
    remaining: Callable[[], Remaining] | None = None
    """Makes the memory of what a page has of the answer; None where it cannot be followed."""
    every: int = 1
    """Looks at the graph for each followed answer."""


class Session:
    """Conversation with one page, from its first question until it is closed."""

    def __init__(
        self,
        questions: Mapping[str, Question],
        send: Callable[[str], None],
        *,
        read_only: bool,
        print_message: Callable[[str], None],
        on_close: Callable[[Session], object] = lambda _session: None,
    ) -> None:
        """Begin a conversation.

        Args:
            questions: what may be asked, by name.
            send: sends a text frame to the page.
            read_only: whether the page may only look.
            print_message: prints a line for the person that started this.
            on_close: is called when the conversation has ended.
        """
        self.following: dict[str, Remaining] = {}
        self._questions, self.send, self._read_only = questions, send, read_only
        self._print, self._on_close = print_message, on_close
        self._tasks: set[asyncio.Task[None]] = set()

    def take(self, message: str | bytes) -> bool:
        """Answer a message of the page; return False where it is one of Foxglove's protocol.

        Raises:
            MalformedMessage: It is neither.
        """
        frame = frames.read(message)
        match frame:
            case None:
                return False
            case frames.Ask():
                self._begin(frame)
            case frames.Follow():
                self._follow(frame)
            case frames.Hello():
                pass  # it is let in already
        return True

    def send_update(self, question: str, found: object) -> None:
        """Send the answer to a question that the page follows."""
        remaining = self.following.get(question)
        part = None if remaining is None else remaining.of(found)
        if part is not None:
            self.send(frames.update(question, part))

    def close(self) -> None:
        """End the conversation; what is being answered is given up."""
        for task in self._tasks:
            task.cancel()
        self._on_close(self)

    def _begin(self, ask: frames.Ask) -> None:
        if len(self._tasks) >= _MOST_ASKED:
            self.send(frames.error(ask.id, f"{_MOST_ASKED} questions are being answered; ask again"))
            return
        self._keep(asyncio.create_task(self._answer(ask)))

    def _keep(self, task: asyncio.Task[None]) -> None:
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _follow(self, follow: frames.Follow) -> None:
        question = self._known(follow.question)
        if question.remaining is None:
            raise MalformedMessage(f"{follow.question} cannot be followed; ask it")
        if not follow.on:
            self.following.pop(follow.question, None)
        elif follow.question not in self.following:
            self.following[follow.question] = question.remaining()
            self._keep(asyncio.create_task(self._send_first(follow.question, question)))

    async def _send_first(self, name: str, question: Question) -> None:
        try:
            self.send_update(name, await question.answer({}))
        except BusflowError:
            pass  # the run is silent, which is reported; a later look sends it
        except Exception as error:  # noqa: BLE001  # as above: a later look sends it
            self._print(mistake(name, error))

    async def _answer(self, ask: frames.Ask) -> None:
        try:
            question = self._allowed(ask)
            self.send(frames.answer(ask.id, await self._found(question, ask)))
        except BusflowError as error:
            self.send(frames.error(ask.id, printable(error, limit=2000)))
        except Exception as error:  # noqa: BLE001  # a page waits for each answer, also where ours is the mistake
            self._print(mistake(ask.question, error))
            self.send(frames.error(ask.id, "busflow failed to answer; its terminal says more"))

    def _found(self, question: Question, ask: frames.Ask) -> Awaitable[object]:
        if question.in_parts is None:
            return question.answer(ask.arguments)
        return question.in_parts(ask.arguments, lambda part: self.send(frames.part(ask.id, part)))

    def _allowed(self, ask: frames.Ask) -> Question:
        found = self._known(ask.question)
        if self._read_only and found.changes(ask.arguments):
            raise NotAllowed("this page may only look")
        return found

    def _known(self, name: str) -> Question:
        found = self._questions.get(name)
        if found is None:
            raise MalformedMessage(f"there is no question {name[:100]!r}; {did_you_mean(name[:100], self._questions)}")
        return found


class AskingOnly:
    """Conversation of a page that may ask its questions, and use nothing of Foxglove's protocol."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def take(self, message: str | bytes) -> bool:
        """Answer a message of the page.

        Raises:
            NotAllowed: It is none of its questions.
            MalformedMessage: It is no question at all.
        """
        if not self._session.take(message):
            raise NotAllowed("this page may only ask the assistant")
        return True

    def close(self) -> None:
        """End the conversation."""
        self._session.close()


def mistake(question: str, error: Exception) -> str:
    """Return the line that reports an answer which failed by a bug in busflow."""
    return f"error: {question} failed; this is a bug in busflow, please report it: {error!r}"
