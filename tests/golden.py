"""Golden texts: each text that a command or a module writes, pinned once in a text file beside the test module.

`golden(text)` compares a text with the section of the running test. The modules of a folder share its `golden.txt`, if
there is one: a section's title is e.g. `test_check.py::test_a`. Else it is `test_a`, in `test_check.txt`.
`with golden.raises(InvalidDeclaration):` pins an error: its code and places in the first line, then its text.
`pytest --update tests/cli/test_check.py` writes the sections anew; read the diff before you commit it.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from difflib import unified_diff
from pathlib import Path

import pytest

from busflow.errors import BusflowError, Place

VARYING = {
    r" at 0x[0-9a-f]+": " at 0x…",  # of an object
    r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}": "UUID",
    r"(open: )?embedded null (byte|character)( in path)?": "embedded null byte",  # Python 3.11, and newer ones
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
    if texts:
        file.write_text("\n".join(f"=== {title}\n{texts[title]}\n" for title in sorted(texts)), "utf-8")
    else:
        file.unlink(missing_ok=True)


def section(module: Path, test: str) -> tuple[Path, str]:
    """Return the golden file of a test, and the title of its section."""
    shared = module.with_name("golden.txt")
    return (shared, f"{module.name}::{test}") if shared.exists() else (module.with_suffix(".txt"), test)


def owner(file: Path, title: str) -> tuple[Path, str]:
    """Return the module of a section and its test, with its part if it has one: the inverse of `section`."""
    if file.name != "golden.txt":
        return file.with_suffix(".py"), title
    name, _, test = title.partition("::")
    return file.with_name(name), test


def is_of(title: str, test: str) -> bool:
    """Whether a section belongs to a test, or to a part of the test."""
    return title == test or title.startswith(f"{test}: ")


def masked(text: str, mask: Mapping[str, str]) -> str:
    """Replace each match of a regular expression, such as a time, a port or a folder of this machine."""
    for pattern, shown in {**VARYING, **mask}.items():
        text = re.sub(pattern, shown, text)
    return text.rstrip("\n")


def shown(place: Place) -> str:
    """Return a place without numbers that any change moves: a line of Python is named by its text."""
    return f"{Path(place.file).name}: {place.excerpt.strip()}" if place.file.endswith(".py") else str(place)


def codes(error: BaseException) -> Iterator[str]:
    """Yield the code of an error, or its class; then the code and the place of all that it carries."""
    yield error.code if isinstance(error, BusflowError) else type(error).__name__
    for fault in getattr(error, "faults", ()):
        yield f"{fault.code} {'.'.join(map(str, fault.path))}".rstrip()
    for problem in getattr(error, "problems", ()):
        yield f"{problem.code} {shown(problem.place)}" if problem.place else problem.code
    if place := getattr(getattr(error, "problem", error), "place", None):
        yield shown(place)


class Golden:
    """The golden texts of one test."""

    def __init__(self, file: Path, title: str, *, update: bool) -> None:
        self.file, self.title, self.update = file, title, update
        self._unnamed, self._stale = 0, update  # until its first text: the test may be skipped

    def __call__(self, text: str, part: str = "", *, mask: Mapping[str, str] | None = None) -> None:
        """Compare a text with the section of this test, or of a part of it, without spaces at line ends.

        The parts of a test have names, or else numbers: the second text without a name is part 2.
        """
        self._unnamed += not part
        part = part or (str(self._unnamed) if self._unnamed > 1 else "")
        title = f"{self.title}: {part}" if part else self.title
        found = re.sub(r"[ \t]+$", "", masked(text, mask or {}), flags=re.MULTILINE)
        assert not HEADING.search(found), "this text has lines which look like the headings of a golden file"
        texts = sections(self.file)
        if self.update:
            others = {each: text for each, text in texts.items() if not (self._stale and is_of(each, self.title))}
            self._stale = False  # its parts may have other names now
            write(self.file, {**others, title: found})
        elif found != texts.get(title):
            lines = unified_diff(texts.get(title, "").splitlines(), found.splitlines(), "pinned", "now", lineterm="")
            pytest.fail(
                "\n".join([f"{self.file.name}: {title}", *lines, "if this is meant: pytest --update"]), pytrace=False
            )

    @contextmanager
    def raises(
        self, expected: type[BaseException], part: str = "", *, mask: Mapping[str, str] | None = None
    ) -> Iterator[pytest.ExceptionInfo[BaseException]]:
        """Expect an error, as `pytest.raises` does, and compare its codes, its places and its text."""
        with pytest.raises(expected) as caught:
            yield caught
        self(f"[{'; '.join(codes(caught.value))}]\n{caught.value}", part, mask=mask)


def forget_removed(items: Iterable[pytest.Item]) -> None:
    """Remove the sections of tests that are gone, or pin nothing any more, in the folders of these items.

    The items are all tests of their modules. Sections of other modules are kept, unless a module is gone.
    """
    pinned = {section(item.path, item.name) for item in items if "golden" in getattr(item, "fixturenames", ())}
    modules = {item.path for item in items}
    for file in (file for folder in {module.parent for module in modules} for file in golden_files(folder)):
        texts, titles = sections(file), [title for each, title in pinned if each == file]
        gone = {
            title
            for title in texts
            if ((module := owner(file, title)[0]) in modules or not module.exists())
            and not any(is_of(title, each) for each in titles)
        }
        if gone:
            write(file, {title: text for title, text in texts.items() if title not in gone})


def golden_files(folder: Path) -> list[Path]:
    """Return the golden files of a folder."""
    return [*folder.glob("golden.txt"), *folder.glob("test_*.txt")]


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Golden:
    """`golden(capsys.readouterr().out)`: the text is the one in the golden file beside this module."""
    return Golden(*section(request.path, request.node.name), update=request.config.getoption("--update"))
