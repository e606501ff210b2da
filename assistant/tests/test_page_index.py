"""The index follows its files, and says what it leaves out."""

from pathlib import Path

import pytest

from busflow.testing import harness, virtual_time
from busflow_assistant.conversions import page_from_message, page_to_message
from busflow_assistant.markdown import read_page
from busflow_assistant.messages import Index
from busflow_assistant.page_files import ReadingLimits, read_pages
from busflow_assistant.page_index import PageIndex
from tests.golden import Golden

TESTS = Path(__file__).parent


@pytest.fixture
def book(tmp_path: Path) -> Path:
    (tmp_path / "deep").mkdir()
    (tmp_path / "one.md").write_text("# One\n\nThe first page.\n")
    (tmp_path / "deep/two.md").write_text("# Two\n\nThe second page.\n")
    (tmp_path / "notes.txt").write_text("no page")
    return tmp_path


def names(index: Index) -> list[str]:
    return [page.name for page in index.pages]


@virtual_time
async def test_pages_of_a_folder_are_published(book: Path):
    async with harness(PageIndex(pages=[str(book)])) as lab:
        (index,) = lab.received("assistant/index", Index)
        assert names(index) == ["one.md", "deep/two.md"]
        assert [page.title for page in index.pages] == ["One", "Two"]


@virtual_time
async def test_changed_file_is_published_within_a_second(book: Path):
    async with harness(PageIndex(pages=[str(book)])) as lab:
        (book / "one.md").write_text("# One\n\nIt is another page now.\n")
        await lab.advance(1)
        assert "another page" in lab.received("assistant/index", Index)[-1].pages[0].source
        (book / "deep/two.md").unlink()
        await lab.advance(1)
        assert names(lab.received("assistant/index", Index)[-1]) == ["one.md"]


@virtual_time
async def test_unchanged_files_are_published_once(book: Path):
    async with harness(PageIndex(pages=[str(book)])) as lab:
        await lab.advance(60)
        assert len(lab.received("assistant/index", Index)) == 1


@virtual_time
async def test_what_is_left_out_is_logged_once(book: Path, golden: Golden):
    (book / "bad.md").write_bytes(b"\xff\xfe")
    async with harness(PageIndex(pages=[str(book)])) as lab:
        (book / "one.md").write_text("# Changed\n")
        await lab.advance(2)
        golden("\n".join(lab.received("assistant/index", Index)[-1].left_out))
        golden("\n".join(line.event for line in lab.log if line.level == "warning"))


@virtual_time
async def test_folder_without_a_page_is_a_warning(tmp_path: Path, golden: Golden):
    async with harness(PageIndex(pages=[str(tmp_path)])) as lab:
        golden("\n".join(line.event for line in lab.log))
        (tmp_path / "late.md").write_text("# Late\n")
        await lab.advance(1)
        assert names(lab.received("assistant/index", Index)[-1]) == ["late.md"]


def test_limits_leave_pages_out(book: Path):
    assert len(read_pages([str(book)], ReadingLimits(pages=1)).left_out) == 1
    assert len(read_pages([str(book)], ReadingLimits(page_bytes=5)).left_out) == 2
    assert len(read_pages([str(book)], ReadingLimits(total_bytes=30)).left_out) == 1


def test_link_out_of_the_folder_is_no_page(book: Path, tmp_path_factory: pytest.TempPathFactory):
    outside = tmp_path_factory.mktemp("outside") / "secret.md"
    outside.write_text("# Secret\n")
    (book / "link.md").symlink_to(outside)
    assert [page.name for page in read_pages([str(book)], ReadingLimits()).pages] == ["one.md", "deep/two.md"]


def test_missing_file_is_left_out_with_the_reason(tmp_path: Path, golden: Golden):
    found = read_pages([str(tmp_path / "gone.md")], ReadingLimits())
    golden("\n".join(found.left_out))


def test_pages_of_docusaurus_are_read(tmp_path: Path):
    (tmp_path / "intro.mdx").write_text("# Intro\n\nIt begins here.\n")
    assert [page.name for page in read_pages([str(tmp_path)], ReadingLimits()).pages] == ["intro.mdx"]


def test_second_page_of_a_name_is_left_out(book: Path, golden: Golden):
    found = read_pages([str(book / "one.md"), str(book)], ReadingLimits())
    assert [page.name for page in found.pages] == ["one.md", "deep/two.md"]
    golden("\n".join(found.left_out))


def test_page_survives_its_message():
    page = read_page("lab1.md", (TESTS / "pages/lab1.md").read_text(encoding="utf-8"))
    assert page_from_message(page_to_message(page)) == page
