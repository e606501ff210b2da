"""Golden texts: each text that a command or a module writes, pinned once in a text file beside the test module.

`golden(text)` compares a text with the section of the running test in `test_check.txt`, beside `test_check.py`;
`with golden.raises(InvalidDeclaration):` does so with the text of an error.
`pytest --update tests/cli/test_check.py` writes the sections anew; read the diff before you commit it.
"""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from difflib import unified_diff
from pathlib import Path

import pytest

VARYING = {
    r" at 0x[0-9a-f]+": " at 0x…",  # of an object
    r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}": "UUID",
    r"embedded null (byte|character)": "embedded null byte",  # Python 3.11, and newer ones
    r"[^\s'\"]*/pytest-of-[^/]+/pytest-\d+(/popen-gw\d+)?/\w+": "TMP_PATH",
    r"(?:/[^\s'\":]*/)?\b((busflow|tests)/[\w/]+\.py):\d+(:\d+)?": r"\1:…",  # a line that moves
}
"""Parts of a text that vary from run to run, each with the word that stands for it."""

HEADING = re.compile(r"^=== (.+)\n", re.MULTILINE)


def sections(file: Path) -> dict[str, str]:
    """Return the texts of a golden file by their titles: the name of a test, with a part if it has several texts."""
    _, *parts = HEADING.split(file.read_text("utf-8")) if file.exists() else [""]
    return {title: text.rstrip("\n") for title, text in zip(parts[::2], parts[1::2], strict=True)}


def write(file: Path, texts: Mapping[str, str]) -> None:
    """Write a golden file, its sections in the order of their titles, so that two changes rarely meet."""
    file.write_text("\n".join(f"=== {title}\n{texts[title]}\n" for title in sorted(texts)), "utf-8")


def masked(text: str, mask: Mapping[str, str]) -> str:
    """Replace each match of a regular expression, such as a time, a port or a folder of this machine."""
    for pattern, shown in {**VARYING, **mask}.items():
        text = re.sub(pattern, shown, text)
    return text.rstrip("\n")


class Golden:
    """The golden texts of one test."""

    def __init__(self, file: Path, test: str, *, update: bool) -> None:
        self.file, self.test, self.update = file, test, update
        self._unnamed = 0

    def __call__(self, text: str, part: str = "", *, mask: Mapping[str, str] | None = None) -> None:
        """Compare a text with the section of this test, or of a part of it, without spaces at line ends.

        The parts of a test have names, or else numbers: the second text without a name is part 2.
        """
        self._unnamed += not part
        part = part or (str(self._unnamed) if self._unnamed > 1 else "")
        title = f"{self.test}: {part}" if part else self.test
        found = re.sub(r"[ \t]+$", "", masked(text, mask or {}), flags=re.MULTILINE)
        assert not HEADING.search(found), "this text has lines which look like the headings of a golden file"
        texts = sections(self.file)
        if self.update:
            write(self.file, {**texts, title: found})
        elif found != texts.get(title):
            lines = unified_diff(texts.get(title, "").splitlines(), found.splitlines(), "pinned", "now", lineterm="")
            pytest.fail(
                "\n".join([f"{self.file.name}: {title}", *lines, "if this is meant: pytest --update"]), pytrace=False
            )

    @contextmanager
    def raises(
        self, expected: type[BaseException], part: str = "", *, mask: Mapping[str, str] | None = None
    ) -> Iterator[pytest.ExceptionInfo[BaseException]]:
        """Expect an error, as `pytest.raises` does, and compare its text."""
        with pytest.raises(expected) as caught:
            yield caught
        self(str(caught.value), part, mask=mask)


def forget(file: Path, test: str) -> None:
    """Remove the sections of a test whose texts are about to be written anew."""
    kept = {title: text for title, text in sections(file).items() if title != test and not title.startswith(f"{test}:")}
    write(file, kept) if kept else file.unlink(missing_ok=True)


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Golden:
    """`golden(capsys.readouterr().out)`: the text is the one in the golden file beside this module."""
    update = request.config.getoption("--update")
    file = request.path.with_suffix(".txt")
    if update:
        forget(file, request.node.name)
    return Golden(file, request.node.name, update=update)
