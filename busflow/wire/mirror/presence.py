"""Presence: what the other sessions of a run show of themselves, as far as it is dealt with here."""

from __future__ import annotations

from collections.abc import Callable, Collection

from busflow.wire.zenoh.keys import Kind, Token

_MOST = 10_000
"""Tokens that are kept in mind: whoever shows more is at fault, or means harm."""


class Presence:
    """The tokens of others; who waits for them hears of every change."""

    def __init__(self) -> None:
        self.tokens: dict[str, Token] = {}
        """By their text. Two processes that only look are not linked to each other: they ask one that has these."""
        self.on_change: list[Callable[[], None]] = []

    def note(self, text: str, token: Token, *, alive: bool) -> None:
        """A token has come or gone, and all that follows from it is done."""
        if not alive:
            self.tokens.pop(text, None)
        elif len(self.tokens) < _MOST:
            self.tokens[text] = token
        self.tell()

    def tell(self) -> None:
        """Something has changed that somebody may wait for."""
        for hear in tuple(self.on_change):
            hear()

    def count(self, session: str) -> int:
        """How many tokens of a session are there."""
        return sum(token.session == session for token in self.tokens.values())

    def received(self, sessions: Collection[str] | None = None) -> set[str]:
        """The topics that nodes of these sessions receive, or of any."""
        found = [token for token in self.tokens.values() if sessions is None or token.session in sessions]
        return {token.topic for token in found if token.kind is Kind.SUBSCRIPTION}
