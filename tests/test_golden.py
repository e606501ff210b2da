"""Golden texts: a difference fails, `--update` writes them anew, and each section belongs to a test."""

import re
from pathlib import Path

import pytest

from busflow.errors import Fault, InvalidParameter, LaunchError, Place, PluginError, Problem
from tests.golden import HEADING, Golden, golden_files, owner, section, sections

pytest_plugins = ("pytester",)

ROOT = Path(__file__).parents[1]
PINNED = [
    file
    for tests in ("tests", "ui/tests", "assistant/tests")
    for folder in sorted({module.parent for module in ROOT.glob(f"{tests}/**/*.py")})
    for file in golden_files(folder)
]
A_MODULE = """
    import pytest

    @pytest.mark.parametrize("late", [1, 2])
    def test_a(late, golden):
        golden(f"{late} s late")

    def test_b(golden):
        golden("late", "end")

    def test_c():
        pass

    def test_d(golden):
        pytest.skip("not here")
"""


def test_a_difference_fails_until_it_is_updated(tmp_path: Path):
    file = tmp_path / "test_clock.txt"
    Golden(file, "test_b", update=True)("later", "end")
    Golden(file, "test_a", update=True)("at 12:01  \nin /home/x1", mask={r"\d\d:\d\d": "TIME", "/home/x1": "FOLDER"})
    assert file.read_text() == "=== test_a\nat TIME\nin FOLDER\n\n=== test_b: end\nlater\n"
    Golden(file, "test_b", update=False)("later", "end")
    with pytest.raises(pytest.fail.Exception, match="--update"):
        Golden(file, "test_b", update=False)("earlier", "end")
    with pytest.raises(pytest.fail.Exception, match="--update"):
        Golden(file, "test_c", update=False)("later")


def test_texts_without_a_name_are_numbered(tmp_path: Path):
    golden = Golden(tmp_path / "test_clock.txt", "test_a", update=True)
    golden("1 s late")
    golden("2 s late")
    assert sections(golden.file) == {"test_a": "1 s late", "test_a: 2": "2 s late"}


@pytest.mark.parametrize(
    ("error", "first_line"),
    [
        (KeyError("x"), "[KeyError]"),
        (InvalidParameter([Fault(("a", "b"), "?", code="range")]), "[invalid-parameter; range a.b]"),
        (LaunchError([Problem("yaml", "?", None, Place("a.yaml", 1, 2))]), "[launch-error; yaml a.yaml:1:2]"),
        (PluginError(Problem("no-import", "?", None, Place("p/a.py", 9, 1, 1, " x()"))), "[no-import; a.py: x()]"),
    ],
    ids=lambda each: type(each).__name__,
)
def test_an_error_is_pinned_with_its_codes_and_places(error: Exception, first_line: str, tmp_path: Path):
    golden = Golden(tmp_path / "test_clock.txt", "test_a", update=True)
    with golden.raises(type(error)):
        raise error
    assert sections(golden.file)["test_a"].splitlines()[0] == first_line


@pytest.mark.parametrize("shared", [False, True])
def test_an_update_keeps_the_sections_of_other_tests_alone(pytester: pytest.Pytester, shared: bool):
    stale = ["test_a[1]: 2", "test_a[3]", "test_c", "test_d", "test_gone"]
    pytester.makeconftest("from tests.conftest import golden, pytest_addoption, pytest_collection_modifyitems")
    pytester.makepyfile(test_x=A_MODULE)
    pytester.makepyfile(test_y="def test_b(golden): golden('early')")
    if shared:
        pytester.path.joinpath("golden.txt").touch()
    files = {name: section(pytester.path / name, "")[0] for name in ("test_x.py", "test_y.py", "test_z.py")}
    for title in stale:
        Golden(*section(pytester.path / "test_x.py", title), update=True)("old")
    Golden(*section(pytester.path / "test_z.py", "test_a"), update=True)("old")

    def update(*arguments: str) -> list[str]:
        assert pytester.inline_run("-p", "no:asyncio", "--update", *arguments).ret == 0
        found = [(file, title) for file in sorted(set(files.values())) for title in sections(file)]
        return [f"{module.stem} {test}" for module, test in (owner(*each) for each in found)]

    every = [f"test_x {title}" for title in sorted([*stale, "test_b: end"])]
    assert update("test_x.py::test_b") == [*every, "test_z test_a"]
    assert update("test_y.py") == [*every, "test_y test_b"]
    kept = ["test_x test_b: end", "test_x test_d", "test_y test_b"]
    assert update("-k", "test_b") == ["test_x test_a[1]: 2", *kept]
    assert update() == ["test_x test_a[1]", "test_x test_a[2]", *kept]


@pytest.mark.parametrize("file", PINNED, ids=lambda file: str(file.relative_to(ROOT)))
def test_each_section_belongs_to_a_test(file: Path):
    titles = HEADING.findall(file.read_text("utf-8"))
    assert len(titles) == len(sections(file)) > 0
    for title in titles:
        module, test = owner(file, title)
        assert section(module, test) == (file, title)
        (function,) = re.findall(r"^test_\w+", test)
        assert f"def {function}(" in module.read_text("utf-8")
