"""The rules of the house that no linter knows: sizes, names, reasons, and who may read the time."""

import ast
import io
import os
import re
import tokenize
import tomllib
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest
from code_lines import BESIDE, code_lines, rows, total, tree

import busflow

ROOT = Path(__file__).parents[1]
CLOCK = ROOT / "busflow/clock.py"
UI = ROOT / "ui"
"""The distribution busflow-ui. The rules apply to it and to `assistant/`; busflow's source distribution has neither."""
PARTS = ("busflow", "plugins", "ui/busflow_ui", "assistant/busflow_assistant")
PRODUCT = sorted(path for part in PARTS for path in ROOT.glob(f"{part}/**/*.py"))
EVERYTHING = sorted(
    [
        *PRODUCT,
        *(
            path
            for part in ("tests", "benchmarks", "docs", "ui/tests", "assistant/tests")
            for path in ROOT.glob(f"{part}/**/*.py")
        ),
    ]
)
TEMPLATES = sorted(ROOT.glob("busflow/cli/templates/*.py.txt"))
TESTS = {
    "busflow": ROOT / "tests",
    "ui/busflow_ui": UI / "tests",
    "assistant/busflow_assistant": ROOT / "assistant/tests",
}
"""The tests of each distribution."""

GENERATED = "\n# busflow interface generate "
"""A line of every module that this command wrote: one module a package, however long."""

FUNCTION_LINES = 50
FILE_LINES = 500
PACKAGE_FILES = 25
ROOT_FILES = 12
SLACK = 1.05
"""By how much a package may exceed its budget."""
VAGUE = {"util", "utils", "common", "core", "manager", "helper", "helpers", "base", "misc", "types", "stuff"}

READS_TIME = re.compile(
    r"time\.(time|monotonic|perf_counter|process_time)(_ns)?|time\.sleep|asyncio\.sleep"
    r"|anyio\.(sleep\w*|current_time)|(datetime\.)?datetime\.(now|utcnow|today)|(datetime\.)?date\.today"
)
UNSAFE_MODULES = {"pickle", "marshal", "shelve", "dill", "cloudpickle"}
UNSAFE_CALLS = {"eval", "exec", "compile", "__import__", "yaml.load", "yaml.unsafe_load", "yaml.full_load", "os.system"}
SUSPECT = re.compile("|".join([READS_TIME.pattern, "from time", *UNSAFE_MODULES, *map(re.escape, UNSAFE_CALLS)]))
"""In the text of each file that may do so; the test does not look further into other files."""

EXCEPTIONS: dict[tuple[str, str], str] = {
    (
        "busflow/interfaces/codegen.py",
        "exec",
    ): "writes constructors and codecs of message classes, of checked words: twice as fast as tables",
}
"""Who may do what nobody else may, and why."""

PAGE_IMPORT = re.compile(r'\b(?:from|import) ?\(?"(\.[^"]+)"')
"""An import of one module of the page by another one, also of its types alone."""

IGNORE = re.compile(
    r"#\s*(noqa(:\s*[A-Z]+[0-9]+(,\s*[A-Z]+[0-9]+)*)?|type:\s*ignore(\[[^]]*\])?|pyright:\s*\w+(\[[^]]*\])?"
    r"|pragma:[\w ]*)(?P<reason>.*)"
)


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def comments(path: Path) -> Iterator[tuple[int, str]]:
    """Each comment with its line; an ignore inside a string or a docstring is only text."""
    for token in tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def dotted(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


def times_read(node: ast.AST) -> Iterator[str]:
    """Each way in which a piece of code reads the time or waits; `sleep(0)` only lets others have a turn."""
    if isinstance(node, ast.ImportFrom) and node.module == "time":
        yield from (f"time.{each.name}" for each in node.names)
    for inner in ast.iter_child_nodes(node):
        asleep = isinstance(inner, ast.Call) and dotted(inner.func) in {"asyncio.sleep", "anyio.sleep"}
        if asleep and ast.unparse(inner).endswith("(0)"):
            continue
        if isinstance(inner, ast.Attribute) and READS_TIME.fullmatch(dotted(inner)):
            yield dotted(inner)
        yield from times_read(inner)


def unsafe(node: ast.AST) -> Iterator[str]:
    """Each import and call in a piece of code by which data could become code."""
    for inner in ast.walk(node):
        if isinstance(inner, ast.Import):
            yield from (each.name for each in inner.names if each.name.partition(".")[0] in UNSAFE_MODULES)
        elif isinstance(inner, ast.ImportFrom) and (inner.module or "").partition(".")[0] in UNSAFE_MODULES:
            yield inner.module or ""
        elif isinstance(inner, ast.Call) and dotted(inner.func) in UNSAFE_CALLS:
            yield dotted(inner.func)


class Facts(NamedTuple):
    """The facts about a module that its syntax tree shows."""

    long: list[str]
    unsafe: set[str]
    times: set[str]


@cache
def facts(path: Path) -> Facts:
    code_lines(path)  # while its tree is there
    long = [
        f"{name(path)}:{node.lineno} {node.name}: {node.end_lineno - node.lineno + 1} lines"
        for node in ast.walk(tree(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        if node.end_lineno and node.end_lineno - node.lineno + 1 > FUNCTION_LINES
    ]
    if not SUSPECT.search(path.read_text(encoding="utf-8")):
        return Facts(long, set(), set())
    return Facts(long, set(unsafe(tree(path))), set(times_read(tree(path))) if path != CLOCK else set())


def test_the_files_to_check_are_found():
    assert CLOCK in PRODUCT
    assert ROOT / "tests/test_structure.py" in EVERYTHING
    assert (UI / "busflow_ui/__init__.py" in PRODUCT) is (UI / "tests/conftest.py" in EVERYTHING) is UI.exists()


def test_no_function_is_longer_than_a_screen():
    assert [long for path in PRODUCT for long in facts(path).long] == []


def test_no_file_is_longer_than_its_limit():
    texts = {name(path): path.read_text(encoding="utf-8") for path in PRODUCT}
    lengths = {path: len(text.splitlines()) for path, text in texts.items() if GENERATED not in text}
    assert {path: length for path, length in lengths.items() if length > FILE_LINES} == {}


def test_every_package_keeps_its_budget():
    budget = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["busflow"]["budget"]
    found = {row: total(paths) for row, paths in rows().items()}
    assert found.keys() <= budget.keys() <= found.keys() | BESIDE.keys()
    assert {row: size for row, size in found.items() if size > SLACK * budget[row]} == {}


def test_no_package_has_too_many_files():
    packages = {path.parent for path in (ROOT / "busflow").rglob("__init__.py")} - {ROOT / "busflow"}
    files = {name(package): sorted(package.glob("*.py")) for package in packages}
    assert {package: len(paths) for package, paths in files.items() if len(paths) > PACKAGE_FILES} == {}
    assert len(list((ROOT / "busflow").glob("*.py"))) <= ROOT_FILES


def test_every_package_has_a_least_coverage():
    table = (ROOT / ".ci/coverage").read_text("utf-8")
    rows = re.findall(r'^(?:table=")?\d+ ([a-z0-9 ]+?)(?: : [a-z0-9_/. ]+)?"?$', table, re.MULTILINE)
    packages = {path.parent.name for path in (ROOT / "busflow").glob("*/__init__.py")}
    assert {package for row in rows for package in row.split()} == packages


def test_every_file_has_a_plain_name():
    assert [name(path) for path in EVERYTHING if path.stem in VAGUE or path.parent.name in VAGUE] == []


def test_every_ignore_gives_its_reason():
    bare = [
        f"{name(path)}:{line}: {comment}"
        for path in EVERYTHING
        if IGNORE.search(path.read_text(encoding="utf-8"))
        for line, comment in comments(path)
        if (found := IGNORE.match(comment)) and not re.search(r"\w", found["reason"])
    ]
    assert bare == []


def test_only_the_clock_reads_time_nothing_evaluates():
    found = {(name(path), each) for path in PRODUCT for each in facts(path).unsafe | facts(path).times}
    assert found - EXCEPTIONS.keys() == set()
    assert EXCEPTIONS.keys() - found == set(), "an exception that nobody needs any more"


@pytest.mark.parametrize("path", [*sorted(ROOT.glob("plugins/**/*.py")), *TEMPLATES], ids=name)
def test_plugins_use_public_names_only(path: Path):
    used = [
        (node.module, each.name)
        for node in ast.walk(tree(path))
        if isinstance(node, ast.ImportFrom) and node.module and node.module.partition(".")[0] == "busflow"
        for each in node.names
    ]
    public = {"busflow", "busflow.testing"} if path in TEMPLATES else {"busflow"}
    inner = [pair for pair in used if pair[0] not in public and not pair[0].startswith("busflow.msgs.")]
    unknown = [pair for pair in used if pair[0] == "busflow" and pair[1] not in busflow.__all__]
    modules = [
        each.name
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Import)
        for each in node.names
        if each.name.startswith("busflow.") and not each.name.startswith("busflow.msgs.")
    ]
    assert (inner, unknown, modules) == ([], [], [])


def test_imports_of_the_page_go_in_no_circle():
    files = set((UI / "page/src").rglob("*.ts*"))
    imports = {
        file: {
            target
            for address in PAGE_IMPORT.findall(file.read_text("utf-8"))
            for ending in (".ts", ".tsx")
            if (target := Path(os.path.normpath(file.parent / f"{address}{ending}"))) in files
        }
        for file in files
    }
    TopologicalSorter(imports).prepare()  # raises CycleError, with the circle


def test_each_module_has_a_test_module():
    """`bus/topic.py` has `bus/test_topic.py`; small modules may share the one of their package, which names them."""
    missing: list[str] = []
    for package, tests in TESTS.items():
        for path in sorted((ROOT / package).rglob("*.py")):
            inner = path.relative_to(ROOT / package)
            if path.name in {"__init__.py", "__main__.py"} or (tests / inner.parent / f"test_{inner.name}").exists():
                continue
            owner = inner.parent.name or Path(package).name
            shared = tests / inner.parent / f"test_{owner}.py"
            if not shared.exists() and inner.parent.name:
                shared = tests / inner.parent.parent / f"test_{owner}.py"
            said = ast.get_docstring(tree(shared)) or "" if shared.exists() else ""
            if f"`{inner.name}`" not in said:
                missing.append(name(path))
    assert missing == []
