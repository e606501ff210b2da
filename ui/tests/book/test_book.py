"""A book from Markdown: what is in it, what stays out, and that each text says where it stands in the source.

Of `book.py`, `export.py`, `folder.py`, `highlighting.py`, `inline_places.py`, `live_parts.py`, `page_html.py`,
`rendering.py`, `site.py` and `source_lines.py`.
"""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.errors import InvalidInput
from busflow_ui.book.book import Book
from busflow_ui.book.export import export
from busflow_ui.book.live_parts import LivePart, read
from busflow_ui.book.rendering import rendered
from busflow_ui.book.site import BookSite
from tests.golden import Golden

ROOT = Path(__file__).parents[3]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
MARKUP = "<img src=x onerror=alert(1)><script>alert(2)</script><b>bold</b>"


WRITTEN = {"x | y": "x \\| y", "a|b": "a\\|b", "&": "&amp;", "*": "\\*"}
"""Text that differs from its source."""


class AllLinks:
    """Links that lead where they say."""

    def link(self, address: str) -> str | None:
        return address

    def image(self, address: str) -> str | None:
        return address


class Placed(HTMLParser):
    """The pieces of a page that state a place in the source: place, end where it is stated, text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.pieces: list[tuple[int, int | None, str]] = []
        self.elsewhere = ""
        self._open: list[tuple[str, dict[str, str | None], list[str]]] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in {"img", "br", "hr"}:
            self._open.append((tag, dict(attrs), []))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take a line or a rule, which holds nothing."""

    def handle_data(self, data: str) -> None:
        placed = [text for _, attributes, text in self._open if "data-s" in attributes]
        for text in placed:
            text.append(data)
        if not placed:
            self.elsewhere += data

    def handle_endtag(self, tag: str) -> None:
        opened, attributes, text = self._open.pop()
        assert opened == tag
        if (start := attributes.get("data-s")) is not None:
            end = attributes.get("data-e")
            self.pieces.append((int(start), None if end is None else int(end), "".join(text)))


def placed(source: str) -> Placed:
    found = Placed(rendered(source, AllLinks()).html)
    for start, end, text in found.pieces:
        if end is None:
            assert source[start : start + len(text)] == text
        else:
            assert 0 <= start < end <= len(source)
    ends = [start + len(text) if end is None else end for start, end, text in found.pieces]
    assert all(end <= after for end, (after, _, _) in zip(ends, found.pieces[1:], strict=False)), (
        "none stands in another"
    )
    return found


def book(folder: Path, **pages: str) -> Book:
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text, "utf-8")
    return Book([folder])


def page(found: Book, address: str) -> str:
    answer = BookSite(found).answer(address)
    assert answer is not None
    return answer.body.decode()


# Places.


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_every_text_of_our_pages_is_placed(path: Path):
    found = placed(path.read_bytes().decode("utf-8-sig"))
    others = re.sub(r"Here is .*?, live, while the lab runs: busflow run \S+\.yaml", " ", found.elsewhere)
    assert set(others.split()) <= set(re.findall(r'title="([^"]*)"', path.read_text("utf-8"))), "only names of files"


@pytest.mark.parametrize(
    ("source", "pieces"),
    [
        ("a **b `c` _d_** e", ["a ", "b ", "c", " ", "d", " e"]),
        ("- 1\n  1. 1\n", ["1", "1"]),
        ("# # a # #\n", ["# a #"]),
        ("> [b](b)b\n> b", ["b", "b", "b"]),
        ("| a | a |\n|---|---|\n| `x \\| y` | a\\|b |\n", ["a", "a", "x | y", "a|b"]),
        ("``` python\nx = 1\n\n  y = 2\n```\n", ["x = 1", "  y = 2"]),
        (
            "2 * 3 ** 4 \\* &amp; <https://x.y>\r\nz",
            ["2 ", "*", " 3 ", "*", "*", " 4 ", "*", " ", "&", " ", "https://x.y", "z"],
        ),
        ("grün 🤖 `a`", ["grün 🤖 ", "a"]),
    ],
)
def test_places_are_exact(source: str, pieces: list[str]):
    found = placed(source).pieces
    assert [text for _, _, text in found] == pieces
    assert {text: source[start:end] for start, end, text in found if end is not None}.items() <= WRITTEN.items()


_WORDS = st.sampled_from(
    ["a", "b c", "*", "**", "`", "``", "[", "](x)", "|", "\\", "\\|", "&lt;", "<b>", "\n", "\n\n", "- ", "1. ", "> ",
     "# ",     "    ", "```\n", "|-|-|\n", "<!-- x -->", "ü", "🤖", "\r\n", "\t", "~~", "!["]
)  # fmt: skip


@given(st.lists(_WORDS, max_size=30).map("".join))
def test_any_markdown_has_true_places(source: str):
    placed(source)


# Text is text.


def test_raw_html_stays_text(tmp_path: Path):
    html = page(book(tmp_path, a=f"# {MARKUP}\n\n{MARKUP}\n\n```{MARKUP}\n{MARKUP}\n```\n"), "a.html")
    body = html.partition("<article>")[2]
    assert "<script" not in body
    assert "<img" not in body
    assert "<b>" not in html
    assert "&lt;script&gt;" in body


@pytest.mark.parametrize(
    "address", ["javascript:alert(1)", "data:text/html,x", "vbscript:x", "file:///etc/passwd", "//x"]
)
def test_a_link_leads_to_no_script(tmp_path: Path, address: str):
    html = page(book(tmp_path, a=f"[x]({address}) ![y]({address})"), "a.html").partition("<article>")[2]
    assert not re.search(rf'(?:href|src)="{re.escape(address)}', html)


def test_pictures_of_other_sites_are_not_loaded(tmp_path: Path):
    html = page(book(tmp_path, a="![a robot](https://evil.example/x.png)"), "a.html")
    assert "<img" not in html
    assert "a robot" in html


def test_no_page_has_an_inline_style(tmp_path: Path):
    html = page(book(tmp_path, a="| a | b |\n|--:|:-:|\n| 1 | 2 |\n"), "a.html")
    assert "style=" not in html
    assert 'class="side-right"' in html


# Files.


def test_no_path_leaves_the_folder(tmp_path: Path):
    inside = tmp_path / "book"
    inside.mkdir()
    (tmp_path / "secret.md").write_text("# Secret")
    (tmp_path / "secret.png").write_bytes(b"secret")
    (inside / "link.md").symlink_to(tmp_path / "secret.md")
    (inside / "link.png").symlink_to(tmp_path / "secret.png")
    (inside / ".hidden.md").write_text("# Hidden")
    (inside / "n.txt").write_text("notes")
    found = book(inside, a="[s](../secret.md) ![s](../secret.png) [l](link.md) [n](n.txt)")
    site = BookSite(found)
    html = page(found, "a.html")
    assert "href=" not in html.partition("<article>")[2].partition("</article>")[0]
    for path in (
        "../secret.md",
        "../secret.html",
        "%2e%2e/secret.png",
        "link.html",
        "link.png",
        "/etc/passwd",
        "n.txt",
    ):
        assert site.answer(path) is None, path
    assert ".hidden" not in str(found.names())


def test_images_of_the_folder_are_served(tmp_path: Path):
    (tmp_path / "img").mkdir()
    (tmp_path / "img/x y.png").write_bytes(b"picture")
    found = book(tmp_path, a="![x](<img/x y.png>)")
    assert 'src="img/x%20y.png"' in page(found, "a.html")
    answer = BookSite(found).answer("img/x%20y.png")
    assert answer is not None
    assert (answer.kind, answer.body) == ("image/png", b"picture")


def test_wrong_places_are_one_error(tmp_path: Path, golden: Golden):
    (tmp_path / "a").mkdir()
    with golden.raises(InvalidInput) as caught:
        Book([tmp_path / "a"])
    assert caught.value.code == "book-page"
    with golden.raises(InvalidInput, mask={re.escape(str(ROOT)): "PROJECT"}):
        Book([ROOT / "LICENSE"])
    for folder in ("b", "c"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "x.md").write_text("# x")
    with golden.raises(InvalidInput):
        Book([tmp_path / "b", tmp_path / "c"])


def test_unreadable_pages_say_why(tmp_path: Path, golden: Golden):
    (tmp_path / "a.md").write_bytes(b"\xff\xfe")
    (tmp_path / "b.md").write_bytes(b"x" * 1_000_001)
    found = Book([tmp_path])
    for name in ("a.html", "b.html"):
        (reason,) = re.findall(r"This page[^<]*", page(found, name))
        golden(reason)


# Chapters.


def test_the_first_page_orders_the_chapters(tmp_path: Path):
    found = book(tmp_path, a="# A", b="# B `code`", c="# C", README="# Book\n[b](b.md) [a](a.md#x) [z](z.md)")
    assert found.title == "Book"
    assert [each.title for each in found.entries()] == ["Book", "B code", "A", "C"]
    html = page(found, "b.html")
    assert 'rel="prev" href="README.html"' in html
    assert 'rel="next" href="a.html"' in html
    assert 'href="b.html" aria-current="page"' in html
    moved = BookSite(found).answer("")
    assert moved is not None
    assert moved.moved == "README.html"


def test_links_between_folders_are_relative(tmp_path: Path):
    (tmp_path / "part").mkdir()
    (tmp_path / "part/x.md").write_text("[up](../a.md#top) [same](y.md)\n\n## One\n\n## One\n")
    (tmp_path / "part/y.md").write_text("# Y")
    html = page(book(tmp_path, a="# A"), "part/x.html")
    assert 'href="../a.html#top"' in html
    assert 'href="y.html"' in html
    assert 'src="../../book.js"' in html
    assert re.findall(r'<h2[^>]* id="([^"]*)"', html) == ["one", "one-1"]


def test_a_changed_file_is_read_anew(tmp_path: Path):
    found = book(tmp_path, a="# Old")
    assert "Old" in page(found, "a.html")
    (tmp_path / "a.md").write_text("# Changed")
    (tmp_path / "b.md").write_text("# Added")
    html = page(found, "a.html")
    assert "Changed" in html
    assert "Added" in html


def test_the_search_knows_every_section(tmp_path: Path):
    script = book(tmp_path, a="# A & B\n\nfirst\n\n## Part\n\n`x < y` second </script>\n").search_script()
    sections = json.loads(script.removeprefix("globalThis.busflowBook = ").rstrip(";\n"))
    assert [(each["address"], each["heading"], each["text"]) for each in sections] == [
        ("a.html#a--b", "A & B", "first"),
        ("a.html#part", "Part", "x < y second </script>"),
    ]


# Live parts.


def test_a_comment_becomes_a_live_part(tmp_path: Path):
    source = (
        '# A\n\n<!-- busflow-plot topic=/imu/data field="x.y x.z" run=configs/a.yaml -->\n\n'
        "Turn it <!-- busflow-parameter node=/a name=noise.imu --> up.\n<!-- TODO: more -->\n\n<!-- hidden -->\n"
    )
    html = page(book(tmp_path, a=source), "a.html")
    assert '<div class="live live-plot" data-live="plot" data-topic="/imu/data" data-field="x.y x.z">' in html
    assert "<code>busflow run configs/a.yaml</code>" in html
    assert '<span class="live live-parameter" data-live="parameter" data-node="/a" data-name="noise.imu">' in html
    assert "TODO" not in html
    assert "hidden" not in html


@pytest.mark.parametrize(
    "comment",
    [
        "<!-- busflow-plat topic=/a -->",
        "<!-- busflow-plot topic=/a -->",
        "<!-- busflow-plot topic=/a field=x onload=y -->",
        '<!-- busflow-plot topic="<b>" field=x -->',
        "<!-- busflow-plot topic=/a field=x; -->",
        "<!-- busflow-graph {} -->",
    ],
)
def test_a_wrong_live_part_is_named(comment: str, tmp_path: Path, golden: Golden):
    golden(str(read(comment)))
    found = book(tmp_path, a=f"# A\n\n{comment}\n")
    assert [fault for fault in found.faults() if "a.md: line 3: " in fault]
    assert "data-live" not in page(found, "a.html")


def test_other_comments_are_no_parts():
    assert read("<!-- not run: busflow-plot -->") is None
    assert read("<!--busflow-graph-->") == LivePart("graph", {}, "")


# Export.


def test_a_site_needs_no_server(tmp_path: Path):
    built = tmp_path / "built"
    built.mkdir()
    for name in ("book_static.js", "book.css", "icon.svg", "licences.json"):
        (built / name).write_text(name)
    pages = tmp_path / "pages"
    (pages / "part").mkdir(parents=True)
    (pages / "part/x.png").write_bytes(b"picture")
    (pages / "part/b.md").write_text("# B\n![x](x.png)")
    found = book(pages, a="# A\n[b](part/b.md)")
    site = tmp_path / "site"
    for _ in range(2):  # an older export is written over
        assert export(found, built, site) == 2
    html = (site / "part/b.html").read_text("utf-8")
    assert 'src="../_book/book_static.js" defer' in html
    assert 'type="module"' not in html
    assert "Running graph" not in html
    assert (site / "part/x.png").read_bytes() == b"picture"
    assert "url=a.html" in (site / "index.html").read_text("utf-8")
    links = re.findall(r'(?:href|src)="([^"#]*)', html)
    assert all((site / "part" / link).exists() for link in links if link)


def test_an_export_overwrites_nothing_else(tmp_path: Path, golden: Golden):
    found = book(tmp_path, a="# A")
    with golden.raises(InvalidInput) as caught:
        export(found, tmp_path, tmp_path)
    assert caught.value.code == "book-export"
    with golden.raises(InvalidInput):
        export(found, tmp_path / "missing", tmp_path / "site")
