"""Markdown → the HTML of one chapter, in which each piece of text says where it stands in the source. Pure.

`data-s` is the place of the first character of an element whose text is the source's own; with `data-e`, where that
ends, the text differs from it (`&amp;`). `data-from` and `data-to` are those of a block, for what has no finer place.
Raw HTML is text; comments show nothing, but those that name a live part.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, MutableMapping, Sequence
from dataclasses import dataclass, field
from html import escape
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Protocol

from markdown_it import MarkdownIt

from busflow_ui.book import live_parts
from busflow_ui.book.highlighting import highlighted
from busflow_ui.book.inline_places import AT, PlacedInline
from busflow_ui.book.source_lines import SourceLines, SourceRun, place

if TYPE_CHECKING:
    from markdown_it.renderer import RendererHTML
    from markdown_it.ruler import RuleOptionsType
    from markdown_it.rules_block import StateBlock
    from markdown_it.rules_inline import StateInline
    from markdown_it.token import Token
    from markdown_it.utils import OptionsDict

_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_TITLE = re.compile(r'\btitle="([^"]*)"')
_NO_ANCHOR = re.compile(r"[^\w\- ]")
_PLACES = "places"


class Links(Protocol):
    """Where the links and images of a chapter lead."""

    def link(self, address: str) -> str | None:
        """Return the address in the book or of another site; None where it leads out of the folder."""
        ...

    def image(self, address: str) -> str | None:
        """Return the address of an image of the folder; None for any other."""
        ...


@dataclass(frozen=True, slots=True)
class Heading:
    """Heading of a chapter."""

    level: int
    text: str
    anchor: str


@dataclass(slots=True)
class Chapter:
    """A page of Markdown, rendered."""

    html: str = ""
    headings: list[Heading] = field(default_factory=list[Heading])
    links: list[str] = field(default_factory=list[str])
    """Addresses of its links, as they are written."""
    faults: list[str] = field(default_factory=list[str])
    """Comments that name no live part, each with its line and why."""


def rendered(source: str, links: Links) -> Chapter:
    """Return a chapter from its Markdown, as the file has it."""
    lines = SourceLines(source)
    chapter = Chapter()
    env: MutableMapping[str, Any] = {"chapter": chapter, "links": links, "lines": lines}
    tokens = _PARSER.parse(source, env)
    _place(tokens, lines)
    _anchor(tokens, chapter)
    chapter.html = _PARSER.renderer.render(tokens, _PARSER.options, env)
    return chapter


# Comments.


def _comment_block(state: StateBlock, start: int, end: int, silent: bool) -> bool:
    """Take a comment that stands alone in its lines; one in a sentence is inline."""
    at = state.bMarks[start] + state.tShift[start]
    if state.sCount[start] - state.blkIndent >= 4 or not state.src.startswith("<!--", at):
        return False
    found = _COMMENT.match(state.src, at)
    if found is None:
        return False
    last = next((line for line in range(start, end) if state.eMarks[line] >= found.end()), None)
    if last is None or state.src[found.end() : state.eMarks[last]].strip():
        return False
    if not silent:
        state.line = last + 1
        token = state.push("comment", "", 0)
        token.content, token.map, token.block = found[0], [start, last + 1], True
    return True


def _comment_inline(state: StateInline, silent: bool) -> bool:
    found = _COMMENT.match(state.src, state.pos)
    if found is None:
        return False
    if not silent:
        state.push("comment", "", 0).content = found[0]
    state.pos = found.end()
    return True


# Places.


def _place(tokens: Sequence[Token], lines: SourceLines) -> None:
    """Give each piece of text its place in the source."""
    row, cursor = -1, 0
    for index, token in enumerate(tokens):
        if token.type != "inline" or token.map is None or token.children is None:
            continue
        first = token.map[0]
        before = tokens[index - 1].type
        if before in {"th_open", "td_open"}:
            row, cursor = (first, cursor if row == first else 0)
            runs, cursor = lines.inside(token.content, first, cursor)
        elif before == "heading_open" and tokens[index - 1].markup.startswith("#"):
            runs, _ = lines.inside(token.content, first, is_last=True)
        else:
            runs = lines.ending(token.content, first)
        for child in token.children:
            _place_piece(child, token.content, runs, lines.source)


def _place_piece(piece: Token, content: str, runs: Sequence[SourceRun], source: str) -> None:
    """Note where a piece of text begins and ends in the source, if that is known."""
    at = piece.meta.get(AT)
    written = piece.markup if piece.type == "text_special" else piece.content
    if at is None or not written or piece.type not in {"text", "text_special", "code_inline"}:
        return
    if piece.type == "code_inline":
        at += len(piece.markup)
        at += content[at : at + len(written)].replace("\n", " ") != written  # one space at each side is no code
    elif content[at : at + len(written)] != written:
        at = content.find(written, at)  # `<https://…>`: the text begins behind the bracket
    first, last = place(runs, at), place(runs, at + len(written) - 1)
    if first is None or last is None:
        return
    is_verbatim = source[first : last + 1] == piece.content
    piece.meta[_PLACES] = f' data-s="{first}"' + ("" if is_verbatim else f' data-e="{last + 1}"')


def _extent(token: Token, env: MutableMapping[str, Any]) -> str:
    if token.map is None:
        return ""
    start, end = env["lines"].extent(token.map)
    return f' data-from="{start}" data-to="{end}"'


# Headings.


def _anchor(tokens: Sequence[Token], chapter: Chapter) -> None:
    """Give each heading an anchor, of the same form as GitHub's."""
    used: dict[str, int] = {}
    for opening, inline in pairwise(tokens):
        if opening.type == "heading_open":
            text = plain(inline)
            slug = _NO_ANCHOR.sub("", text.lower()).strip().replace(" ", "-") or "section"
            used[slug] = count = used.get(slug, -1) + 1
            anchor = f"{slug}-{count}" if count else slug
            opening.attrSet("id", anchor)
            chapter.headings.append(Heading(int(opening.tag[1:]), text, anchor))


def plain(inline: Token) -> str:
    """Return the text of a block without its markup."""
    return "".join(_plain_pieces(inline.children or ())).strip()


def _plain_pieces(pieces: Sequence[Token]) -> Iterator[str]:
    for piece in pieces:
        if piece.type in {"text", "text_special", "code_inline", "image"}:
            yield piece.content
        elif piece.type in {"softbreak", "hardbreak"}:
            yield " "


# What each kind of token becomes.


def _text(_: RendererHTML, tokens: Sequence[Token], index: int, _o: OptionsDict, _e: MutableMapping[str, Any]) -> str:
    token = tokens[index]
    places = token.meta.get(_PLACES, "")
    return f"<span{places}>{escape(token.content)}</span>" if places else escape(token.content)


def _code_inline(
    _: RendererHTML, tokens: Sequence[Token], index: int, _o: OptionsDict, _e: MutableMapping[str, Any]
) -> str:
    return f"<code{tokens[index].meta.get(_PLACES, '')}>{escape(tokens[index].content)}</code>"


def _fence(_: RendererHTML, tokens: Sequence[Token], index: int, _o: OptionsDict, env: MutableMapping[str, Any]) -> str:
    token = tokens[index]
    lines: SourceLines = env["lines"]
    language = token.info.strip().partition(" ")[0]
    title = _TITLE.search(token.info)
    first = (token.map or [0])[0] + (token.type == "fence")
    starts = {run.at: run.start for run in lines.ending(token.content, first)}
    body: list[str] = []
    at = 0
    texts = token.content.removesuffix("\n").split("\n")
    for text, html in zip(texts, highlighted(token.content, language), strict=True):
        places = f' data-s="{starts[at]}"' if at in starts else ""
        body.append(f'<span class="line"{places}>{html}</span>')
        at += len(text) + 1
    is_named = title is not None and index > 1 and tokens[index - 2].content == f"`{title[1]}`:"
    caption = f"<figcaption>{escape(title[1])}</figcaption>" if title and not is_named else ""
    kind = f' data-language="{escape(language)}"' if language else ""
    return (
        f'<figure class="code"{_extent(token, env)}>{caption}'
        f'<pre tabindex="0"><code{kind}>{chr(10).join(body)}\n</code></pre></figure>\n'
    )


def _opening(
    renderer: RendererHTML, tokens: Sequence[Token], index: int, options: OptionsDict, env: MutableMapping[str, Any]
) -> str:
    """Write a block's opening tag, with its place."""
    html = renderer.renderToken(tokens, index, options, env)
    if not html or tokens[index].hidden:
        return html
    tag = f"<{tokens[index].tag}"
    return html.replace(tag, f"{tag}{_extent(tokens[index], env)}", 1)


def _cell(
    renderer: RendererHTML, tokens: Sequence[Token], index: int, options: OptionsDict, env: MutableMapping[str, Any]
) -> str:
    """Write a cell's opening tag with a class for its side: the page's policy allows no inline style."""
    token = tokens[index]
    style = str(token.attrs.pop("style", ""))
    if style.startswith("text-align:"):
        token.attrSet("class", f"side-{style.removeprefix('text-align:')}")
    return renderer.renderToken(tokens, index, options, env)


def _table(_: RendererHTML, tokens: Sequence[Token], index: int, _o: OptionsDict, env: MutableMapping[str, Any]) -> str:
    is_open = tokens[index].nesting > 0
    extent = _extent(tokens[index], env)
    return f'<div class="table" tabindex="0"><table{extent}>\n' if is_open else "</table></div>\n"


def _link(_: RendererHTML, tokens: Sequence[Token], index: int, _o: OptionsDict, env: MutableMapping[str, Any]) -> str:
    token = tokens[index]
    if token.nesting < 0:
        return "</a>"
    address = str(token.attrs.get("href", ""))
    env["chapter"].links.append(address)
    target = env["links"].link(address)
    title = f' title="{escape(str(token.attrs["title"]))}"' if "title" in token.attrs else ""
    if target is None:
        return f'<a class="outside" title="{escape(address)} is not in this book">'
    elsewhere = ' rel="noopener noreferrer" class="elsewhere"' if ":" in target.partition("/")[0] else ""
    return f'<a href="{escape(target)}"{title}{elsewhere}>'


def _image(_: RendererHTML, tokens: Sequence[Token], index: int, _o: OptionsDict, env: MutableMapping[str, Any]) -> str:
    token = tokens[index]
    address = str(token.attrs.get("src", ""))
    text = plain(token)
    target = env["links"].image(address)
    if target is None:
        return f'<span class="outside" title="{escape(address)} is not in this book">{escape(text or address)}</span>'
    return f'<img src="{escape(target)}" alt="{escape(text)}" loading="lazy">'


def _comment(
    _: RendererHTML, tokens: Sequence[Token], index: int, _o: OptionsDict, env: MutableMapping[str, Any]
) -> str:
    token = tokens[index]
    part = live_parts.read(token.content)
    if isinstance(part, str):
        line = f"line {token.map[0] + 1}: " if token.map else ""
        env["chapter"].faults.append(f"{line}{part}")
        return ""
    return "" if part is None else live_parts.html(part, is_block=token.block)


def _parser() -> MarkdownIt:
    parser = MarkdownIt("commonmark", {"html": False}).enable(["table", "strikethrough"])
    parser.inline = PlacedInline.of(parser.inline)
    parser.core.ruler.disable("text_join")
    stops: RuleOptionsType = {"alt": ["paragraph", "reference", "blockquote"]}
    parser.block.ruler.before("html_block", "comment", _comment_block, stops)
    parser.inline.ruler.before("html_inline", "comment", _comment_inline)
    rules = {
        **dict.fromkeys(("text", "text_special"), _text),
        **dict.fromkeys(("fence", "code_block"), _fence),
        **dict.fromkeys(("paragraph_open", "heading_open", "tr_open"), _opening),
        **dict.fromkeys(("th_open", "td_open"), _cell),
        **dict.fromkeys(("table_open", "table_close"), _table),
        **dict.fromkeys(("link_open", "link_close"), _link),
        "code_inline": _code_inline,
        "image": _image,
        "comment": _comment,
    }
    for name, rule in rules.items():
        parser.add_render_rule(name, rule)
    return parser


_PARSER = _parser()
