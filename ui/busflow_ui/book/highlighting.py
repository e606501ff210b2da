"""Highlighting of code by Pygments, line by line, so that each line keeps its place in the source. Pure."""

from __future__ import annotations

from functools import lru_cache
from html import escape
from typing import TYPE_CHECKING

from pygments import lex
from pygments.lexers import get_lexer_by_name  # pyright: ignore[reportUnknownVariableType]  # its options are any
from pygments.token import STANDARD_TYPES
from pygments.util import ClassNotFound

if TYPE_CHECKING:
    from pygments.lexer import Lexer
    from pygments.token import _TokenType  # pyright: ignore[reportPrivateUsage]  # the stubs' name of a public thing

MOST_CHARACTERS = 100_000
"""Longest code that is highlighted; a longer one is shown plain."""


def highlighted(code: str, language: str) -> list[str]:
    r"""Return the lines of code as HTML; plain where the language is not known.

    >>> highlighted("x = 1\n", "python")
    ['<span class="n">x</span> <span class="o">=</span> <span class="mi">1</span>']
    """
    lexer = _lexer(language)
    plain = code.removesuffix("\n").split("\n")
    if lexer is None or len(code) > MOST_CHARACTERS:
        return [escape(line) for line in plain]
    lines = [""]
    for kind, text in lex(code, lexer):
        first, *others = text.split("\n")
        lines[-1] += _piece(first, kind)
        lines += [_piece(other, kind) for other in others]
    return lines[: len(plain)] if len(lines) >= len(plain) else [escape(line) for line in plain]


@lru_cache(maxsize=64)
def _lexer(language: str) -> Lexer | None:
    if not language or language == "text":
        return None
    try:
        return get_lexer_by_name(language, stripnl=False, ensurenl=True)
    except ClassNotFound:
        return None


def _piece(text: str, kind: _TokenType) -> str:
    name = _class(kind)
    return f'<span class="{name}">{escape(text)}</span>' if text and name else escape(text)


@lru_cache(maxsize=256)
def _class(kind: _TokenType) -> str:
    while kind not in STANDARD_TYPES and kind.parent is not None:
        kind = kind.parent
    name = STANDARD_TYPES.get(kind, "")
    return "" if name == "w" else name  # white space has no colour
