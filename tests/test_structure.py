"""The rules of the house that no linter knows: sizes, names, reasons, and who may read the time."""

import ast
import io
import os
import re
import tokenize
from collections import Counter
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import busflow

ROOT = Path(__file__).parents[1]
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

GENERATED = "\n# busflow interface generate "
"""A line of every module that this command wrote: one module a package, however long."""

FUNCTION_LINES = 50
FILE_LINES = 500
PACKAGE_FILES = 25
PACKAGE_LINES = 2700
ROOT_FILES = 7
LIMIT = re.compile(r"^\| `(?P<name>[\w/]+)` \| (?P<first>\d+) \| (?P<limit>\d+) \| (?P<why>.*?) ?\|$", re.MULTILINE)
"""A row of a decision's table of sizes."""
CORE = {"text", "errors", "validation", "clock", "log", "interfaces", "bus", "node"}
VAGUE = {"util", "utils", "common", "core", "manager", "helper", "helpers", "base", "misc", "types", "stuff"}

READS_TIME = re.compile(
    r"time\.(time|monotonic|perf_counter|process_time)(_ns)?|time\.sleep|asyncio\.sleep"
    r"|anyio\.(sleep\w*|current_time)|(datetime\.)?datetime\.(now|utcnow|today)|(datetime\.)?date\.today"
)
UNSAFE_MODULES = {"pickle", "marshal", "shelve", "dill", "cloudpickle"}
UNSAFE_CALLS = {"eval", "exec", "compile", "__import__", "yaml.load", "yaml.unsafe_load", "yaml.full_load", "os.system"}

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


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def nodes(path: Path) -> list[ast.AST]:
    return list(ast.walk(tree(path)))


def comments(path: Path) -> Iterator[tuple[int, str]]:
    """Each comment with its line; an ignore inside a string or a docstring is only text."""
    for token in tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


@cache
def lines_of_code(path: Path) -> int:
    """Lines that hold code: no blank lines, comments or docstrings."""
    text = path.read_text(encoding="utf-8")
    unseen = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in unseen:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in nodes(path):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            lines -= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return len(lines)


def dotted(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


def test_the_files_to_check_are_found():
    assert ROOT / "busflow/clock.py" in PRODUCT
    assert ROOT / "tests/test_structure.py" in EVERYTHING
    assert (UI / "busflow_ui/__init__.py" in PRODUCT) is (UI / "tests/conftest.py" in EVERYTHING) is UI.exists()


def test_no_function_is_longer_than_a_screen():
    long = [
        f"{name(path)}:{node.lineno} {node.name}: {node.end_lineno - node.lineno + 1} lines"
        for path in PRODUCT
        for node in nodes(path)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        if node.end_lineno and node.end_lineno - node.lineno + 1 > FUNCTION_LINES
    ]
    assert long == []


def test_no_file_is_longer_than_its_limit():
    texts = {name(path): path.read_text(encoding="utf-8") for path in PRODUCT}
    lengths = {path: len(text.splitlines()) for path, text in texts.items() if GENERATED not in text}
    assert {path: length for path, length in lengths.items() if length > FILE_LINES} == {}


def sizes() -> dict[str, int]:
    """Lines of code of each package and root module, of the core, and of all but those that later decisions brought."""
    found: Counter[str] = Counter()
    first = {name for name, (path, _) in limits().items() if path.name.startswith("0018-")}
    for path in (ROOT / "busflow").rglob("*.py"):
        parts = path.relative_to(ROOT / "busflow").with_suffix("").parts
        lines = lines_of_code(path)
        found[parts[0]] += lines
        found["total"] += lines if parts[0] in first else 0
        found["core"] += lines if parts[0] in CORE and "encoding" not in parts else 0
    return found


def limits() -> dict[str, tuple[Path, re.Match[str]]]:
    """The limit of each, and the decision that has it."""
    decisions = sorted(ROOT.glob("docs/decisions/*.md"))
    rows = [(path, row) for path in decisions for row in LIMIT.finditer(path.read_text(encoding="utf-8"))]
    assert len({row["name"] for _, row in rows}) == len(rows), "a package has two limits"
    return {row["name"]: (path, row) for path, row in rows}


def test_every_package_has_a_limit_and_keeps_it():
    found, allowed = sizes(), limits()
    assert found.keys() == allowed.keys()
    over = {
        name: f"{size} > {allowed[name][1]['limit']}"
        for name, size in found.items()
        if size > int(allowed[name][1]["limit"])
    }
    assert over == {}, "make it smaller, or raise the limit by a decision that says why"


def test_raised_limit_links_a_decision():
    for name, (path, row) in limits().items():
        if int(row["limit"]) > int(row["first"]):
            link = re.search(r"\]\(([^)]+)\)", row["why"])
            assert link, f"the limit of {name} in {path.name} is above its first value, with no decision linked"
            assert (path.parent / link[1]).exists(), link[1]


def test_a_limit_falls_with_the_size():
    allowed = limits()
    lowered = {name: size for name, size in sizes().items() if size < int(allowed[name][1]["limit"])}
    for name, size in lowered.items():
        path, row = allowed[name]
        text = path.read_text(encoding="utf-8")
        path.write_text(
            text.replace(row[0], f"| `{name}` | {row['first']} | {size} | {row['why']} |"), encoding="utf-8"
        )
    assert not (lowered and os.environ.get("CI")), f"run this test and commit the lowered limits: {lowered}"


def test_no_package_has_too_many_files_or_lines():
    packages = {path.parent for path in (ROOT / "busflow").rglob("__init__.py")} - {ROOT / "busflow"}
    files = {name(package): sorted(package.glob("*.py")) for package in packages}
    assert {package: len(paths) for package, paths in files.items() if len(paths) > PACKAGE_FILES} == {}
    lines = {package: sum(map(lines_of_code, paths)) for package, paths in files.items()}
    assert {package: size for package, size in lines.items() if size > PACKAGE_LINES} == {}
    assert len(list((ROOT / "busflow").glob("*.py"))) <= ROOT_FILES


def test_every_package_has_a_least_coverage():
    rows = re.findall(r'^(?:table=")?\d+ ([a-z0-9 ]+)"?$', (ROOT / ".ci/coverage").read_text("utf-8"), re.MULTILINE)
    packages = {path.parent.name for path in (ROOT / "busflow").glob("*/__init__.py")}
    assert {package for row in rows for package in row.split()} == packages


def test_every_file_has_a_docstring_and_plain_name():
    assert [
        name(path) for path in PRODUCT if path.read_text(encoding="utf-8").strip() and not ast.get_docstring(tree(path))
    ] == []
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


def test_only_the_clock_reads_time_nothing_evaluates():
    others = [path for path in PRODUCT if path != ROOT / "busflow/clock.py"]
    found = {(name(path), each) for path in others for each in times_read(tree(path))}
    found |= {(name(path), each) for path in PRODUCT for each in unsafe(tree(path))}
    assert found - EXCEPTIONS.keys() == set()
    assert EXCEPTIONS.keys() - found == set(), "an exception that nobody needs any more"


@pytest.mark.parametrize("path", [*sorted(ROOT.glob("plugins/**/*.py")), *TEMPLATES], ids=name)
def test_plugins_use_public_names_only(path: Path):
    used = [
        (node.module, each.name)
        for node in nodes(path)
        if isinstance(node, ast.ImportFrom) and node.module and node.module.partition(".")[0] == "busflow"
        for each in node.names
    ]
    public = {"busflow", "busflow.testing"} if path in TEMPLATES else {"busflow"}
    inner = [pair for pair in used if pair[0] not in public and not pair[0].startswith("busflow.msgs.")]
    unknown = [pair for pair in used if pair[0] == "busflow" and pair[1] not in busflow.__all__]
    modules = [
        each.name
        for node in nodes(path)
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
