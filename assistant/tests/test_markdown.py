"""Markdown becomes passages whose spans are the source's own."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow_assistant.markdown import plain, read_page, title
from busflow_assistant.passages import PassageShape

PAGES = sorted((Path(__file__).parent / "pages").glob("*.md"))
SOURCE = """# Title

One, e.g. this. Two `is. not` two
sentences. **Three!**

- an item. Its second sentence
- another

| key | what |
|---|---|
| `depth` | how many |

```console
$ run
done
```

> A quotation.

    indented = True
"""


def units(source: str) -> list[tuple[str, list[str]]]:
    page = read_page("x.md", source)
    return [(each.shape.value, [page.text(unit) for unit in each.units]) for each in page.passages]


def test_each_block_has_its_shape_and_units():
    assert units(SOURCE) == [
        ("heading", ["# Title"]),
        ("prose", ["One, e.g. this.", "Two `is. not` two\nsentences.", "**Three!**"]),
        ("list", ["an item.", "Its second sentence", "another"]),
        ("table", ["| key | what |", "| `depth` | how many |"]),
        ("code", ["$ run", "done"]),
        ("prose", ["A quotation."]),
        ("code", ["indented = True"]),
    ]


def test_headings_stand_above_their_passages():
    page = read_page("x.md", "# A\n\n## B\n\none\n\n### C\n\ntwo\n\n## D\n\nthree\n")
    assert [each.headings for each in page.passages if each.shape is PassageShape.PROSE] == [
        ("A", "B"),
        ("A", "B", "C"),
        ("A", "D"),
    ]
    assert title(page) == "A"


def test_front_matter_of_a_page_is_no_text():
    page = read_page("page.md", "---\r\ntitle: Pumps\r\ntags: [water]\r\n---\r\nA pump moves water.\r\n")
    assert [page.text(each.span) for each in page.passages] == ["A pump moves water."]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_units_are_in_order_within_their_passage(path: Path):
    page = read_page(path.name, path.read_text(encoding="utf-8"))
    assert page.passages
    for passage in page.passages:
        places = [(each.start, each.end) for each in passage.units]
        assert places == sorted(places)
        assert all(passage.span.start <= start < end <= passage.span.end for start, end in places)


@given(st.text(alphabet="ab .!?`*_|#->\n1:\r\t<&[]()", max_size=200))
def test_any_text_gives_spans_within_it(source: str):
    page = read_page("x.md", source)
    for passage in page.passages:
        assert all(0 <= unit.start < unit.end <= len(source) for unit in passage.units)
        assert all(page.text(unit).strip() == page.text(unit) for unit in passage.units)


def test_plain_text_has_no_markup():
    assert plain("| `a` | **b** [c](d.md) |") == "a b c"
