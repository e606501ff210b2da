"""Places of inline text: where each piece of a paragraph stands in the Markdown, which markdown-it-py does not say.

Its rules append text to the state at the state's position, so the state that they are given keeps it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from markdown_it.parser_inline import ParserInline
from markdown_it.rules_inline import StateInline

if TYPE_CHECKING:
    from collections.abc import MutableMapping

    from markdown_it import MarkdownIt
    from markdown_it.token import Token

AT = "at"
"""Key of a token's `meta`: its place in the content of the block, in characters."""


class PlacedState(StateInline):
    """State of the inline parser that gives each token its place."""

    def __init__(self, src: str, md: MarkdownIt, env: MutableMapping[str, Any], out: list[Token]) -> None:
        self._pending_at: int | None = None
        super().__init__(src, md, env, out)

    def append_pending(self, text: str) -> None:
        """Add text to what will be a token, which begins where the first of it stands."""
        if self._pending_at is None:
            self._pending_at = self.pos
        super().append_pending(text)

    def pushPending(self) -> Token:  # noqa: N802  # markdown-it's name
        """Add the token of the text so far."""
        token = super().pushPending()
        token.meta[AT], self._pending_at = self._pending_at, None
        return token

    def push(self, ttype: str, tag: str, nesting: Literal[-1, 0, 1]) -> Token:
        """Add a token."""
        if not self.pending:  # a line break has taken the spaces before it
            self._pending_at = None
        before = self.tokens[-1] if self.tokens else None
        token = super().push(ttype, tag, nesting)
        at = self.pos
        if before is not None and before.type == ttype == "text" and before.meta.get(AT, -1) >= at:
            at = before.meta[AT] + len(before.content)  # `**` becomes two tokens at one position
        token.meta[AT] = at
        return token


class PlacedInline(ParserInline):
    """Inline parser that gives each token its place."""

    @classmethod
    def of(cls, parser: ParserInline) -> PlacedInline:
        """Return one with the rules of another parser, but that which joins pieces of text: they keep their places."""
        found = cls()
        found.__dict__.update(parser.__dict__)
        found.ruler2.disable("fragments_join")
        return found

    def parse(self, src: str, md: MarkdownIt, env: MutableMapping[str, Any], tokens: list[Token]) -> list[Token]:
        """Parse the content of a block."""
        state = PlacedState(src, md, env, tokens)
        self.tokenize(state)
        for rule in self.ruler2.getRules(""):
            rule(state)
        return state.tokens
