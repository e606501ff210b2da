"""Every snippet of README.md and docs/ is run, in a copy of the project: what the pages show is what happens.

- `python` is executed, all snippets of a page in one namespace; `await` may stand at the top, as in a notebook.
- `yaml` is loaded as a launch file.
- `console` is run: `$` begins a command, what follows is what it prints. `…` stands for any text, alone in a line for
  any lines; `^C` presses Ctrl-C. What a clock has measured (a time, a rate, a delay) is not compared, and counts of a
  run on system time need only be near; everything else is compared, numbers too. A command that ends with ` &` has
  printed its lines when the next one begins, and runs until the end of the page. It has a shell and a process of its
  own, as has whatever is more than one command of busflow that ends by itself.
- `title="plugins/tilt.py"` writes the snippet to that file instead, for the commands that follow.
- `<!-- not run: reason -->` above a snippet leaves it out. Other languages are for reading.
"""

import ast
import asyncio
import inspect
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tomllib
from collections import Counter
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from importlib import import_module
from itertools import takewhile
from pathlib import Path
from tempfile import TemporaryFile
from xml.etree import ElementTree as ET

import pytest
from sybil import Document, Region
from sybil.parsers.markdown.lexers import RawFencedCodeBlockLexer

from busflow import commands
from busflow.bus.qos import PRESETS, QoS
from busflow.cli import _COMMANDS as COMMANDS
from busflow.cli import main as busflow
from busflow.cli.run import run
from busflow.launchfile.load.load import load
from busflow.launchfile.model import keys as model

PROJECT = Path(__file__).parents[1]
PROVEN = PROJECT / "docs/errors.md"
"""A page of mistakes: `test_error_codes.py` runs them."""
PAGES = [PROJECT / "README.md", *sorted({*(PROJECT / "docs").rglob("*.md")} - {PROVEN})]
PAGES_WITH_MANY_RUNS = {
    "docs/command-line.md",
    "docs/embedding.md",
    "docs/processes.md",
    "docs/recording.md",
    "docs/testing-robots.md",
    "docs/tutorial/balance.md",
    "docs/tutorial/lab1.md",
    "docs/tutorial/live_noise.md",
    "docs/tutorial/motors.md",
    "docs/tutorial/reset.md",
}
"""The pages whose snippets belong to the long tests."""
HOME = "/home/you/busflow"
"""What the pages call the project's folder."""

_SNIPPETS = RawFencedCodeBlockLexer(re.compile(r'(?P<language>\w+)(?: title="(?P<title>[^"]+)")?$\n', re.MULTILINE))
_NOT_RUN = re.compile(r"<!-- not run: .+ -->\n\Z")
_CLOCKED = re.compile(r"busflow run|busflow topic|busflow replay|pytest|python")
"""The commands whose output has what a clock has measured."""
_OF_A_BUSY_MACHINE = [
    re.compile(r"published before \S+ had started or after it had stopped$"),  # a timer ticks between two stops
    re.compile(r"/sensor_processor: (No sensor data received|.* operational, .* offline)$"),
    re.compile(r"block(s|ed) the event loop"),
]
"""Lines that come on a busy machine alone, and are passed over where a page shows none of their kind."""
_LOGGED = re.compile(r"[0-9]+:[0-9]+:[0-9.]+ ")
_NUMBER = re.compile(r"[0-9]+(?:\\\.[0-9]+)*")
"""A number in an escaped line."""
_VARYING = re.compile(
    "(?P<anything>…)"
    r"|(?P<measured>[0-9]+:[0-9:.]+[0-9]|[0-9]+(\.[0-9]+)?(?= ?(Hz|µs|ms|s|KB/s)\b))"
    r"|(?P<count>(?<=  )[0-9]+(?=  |$))"  # of a table: two spaces from its neighbours
)


def snippets(document):
    """The page's snippets that are run or written; each knows how."""
    for region in _SNIPPETS(document):
        language, title = region.lexemes["language"], region.lexemes["title"]
        evaluate = write if title else EVALUATORS.get(language)
        if evaluate and not _NOT_RUN.search(document.text[: region.start]):
            yield Region(region.start, region.end, (title, region.lexemes["source"]), evaluate)


def write(example):
    title, source = example.parsed
    Path(title).parent.mkdir(exist_ok=True)
    Path(title).write_text(source, encoding="utf-8")


def execute(example):
    _, source = example.parsed
    padded = "\n" * example.line + source
    code = compile(padded, example.path, "exec", flags=ast.PyCF_ALLOW_TOP_LEVEL_AWAIT, dont_inherit=True)
    if code.co_flags & inspect.CO_COROUTINE:
        example.namespace["runner"].get_loop().run_until_complete(eval(code, example.namespace))  # noqa: S307  # our own page
    else:
        exec(code, example.namespace)  # noqa: S102  # our own page


def load_launch_file(example):
    _, source = example.parsed
    file = Path("configs/snippet.yaml")
    file.write_text(source, encoding="utf-8")
    load(file)


def run_console(example):
    _, source = example.parsed
    commands = re.split(r"^\$ ", source, flags=re.MULTILINE)
    assert commands.pop(0) == "", "a console snippet begins with $"
    for each in commands:
        command, *expected = each.rstrip("\n").split("\n")
        if command.endswith(" &"):
            compare(
                command, expected, beginning_of(command.removesuffix(" &"), len(expected), example.namespace["runs"])
            )
            continue
        printed = output_of(command, lines_before_ctrl_c(expected))
        compare(command, [line for line in expected if line != "^C"], printed)


EVALUATORS = {"python": execute, "yaml": load_launch_file, "console": run_console}


def lines_before_ctrl_c(expected):
    """How many lines a command prints before the page presses Ctrl-C, if it does."""
    return len(list(takewhile(lambda line: line != "^C", expected))) if "^C" in expected else None


def output_of(command, lines_before_ctrl_c):
    """What a command prints, both streams together."""
    if (words := words_for_busflow(command)) and lines_before_ctrl_c is None:
        return as_the_pages_have_it(answered(*words))
    with started(command) as process:
        printed = []
        if lines_before_ctrl_c is not None:
            printed = [process.stdout.readline() for _ in range(lines_before_ctrl_c)]
            os.killpg(process.pid, signal.SIGINT)
        printed += process.stdout.readlines()
    return as_the_pages_have_it(printed)


def words_for_busflow(command):
    """Return the arguments of a line that only runs busflow, and whether it shows the exit code; None for others."""
    lexer = shlex.shlex(command, posix=True, punctuation_chars=True)
    lexer.whitespace_split = True
    name, *words = lexer
    if shows_code := words[-3:] == [";", "echo", "exit code $?"]:
        del words[-3:]
    return (words, shows_code) if name == "busflow" and not any(set(word) <= set("();<>|&") for word in words) else None


def answered(words, shows_code):
    """What busflow prints in this process, where it need not be imported anew, which takes most of the time."""
    kept = {name: sys.modules.pop(name) for name in of_the_page()}  # or it would not see what the page has changed
    try:
        with TemporaryFile("w+", buffering=1, encoding="utf-8") as file, redirect_stdout(file), redirect_stderr(file):
            code = busflow(words)
            if shows_code:
                file.write(f"exit code {int(code)}\n")
            file.seek(0)
            return file.readlines()
    finally:
        for name in of_the_page():
            del sys.modules[name]
        sys.modules.update(kept)


def of_the_page():
    """The names of the modules that lie in the page's copy of the project."""
    files = {name: getattr(module, "__file__", None) or "" for name, module in sys.modules.items()}
    return [name for name, file in files.items() if file.startswith(str(Path.cwd()))]


def beginning_of(command, lines, runs):
    """The first lines of a command that goes on, and is left to the page's runs."""
    process = runs.enter_context(started(command))
    runs.callback(process.stdout.read)  # what it prints at its end has to go somewhere
    runs.callback(os.killpg, process.pid, signal.SIGINT)
    return as_the_pages_have_it([process.stdout.readline() for _ in range(lines)])


def started(command):
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "PYTHONUNBUFFERED": "1"}
    environment.pop("PYTEST_ADDOPTS", None)  # meant for the run that this test is part of
    environment["PYTHONWARNINGS"] = "ignore"  # other plugins of pytest that happen to be installed
    return subprocess.Popen(
        ["bash", "-c", command],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=environment,
        text=True,
        encoding="utf-8",
        start_new_session=True,
    )


def as_the_pages_have_it(printed):
    """The lines without this machine's paths, and without blank ones at the end, where a page shows none."""
    lines = "".join(printed).replace(str(Path.cwd()), HOME).rstrip().split("\n")
    return [line.rstrip() for line in lines] if lines != [""] else []


def compare(command, expected, printed):
    """Line by line; `…` takes as many lines as it needs."""
    for kind in _OF_A_BUSY_MACHINE:
        if not any(map(kind.search, expected)):
            printed = [line for line in printed if not kind.search(line)]
    while printed and not printed[-1]:
        printed.pop()
    expected, printed = [[aligned(line) for line in lines] for lines in (expected, printed)]
    is_clocked = bool(_CLOCKED.search(command)) and not any("of sim time" in line for line in expected)
    counts: list[int] = []
    pattern = "".join("(?:.*\n)*?" if line == "…" else matching(line, is_clocked, counts) for line in expected)
    found = re.fullmatch(pattern, "".join(f"{line}\n" for line in printed))
    if not found:
        assert printed == expected, command
    near = max(5, max(counts, default=0) * 0.95)  # a busy machine misses ticks
    for shown, counted in zip(counts, map(int, found.groups()), strict=True):
        assert abs(counted - shown) <= near, f"{command}: {counted} where the page has {shown}"


def matching(line, is_clocked, counts):
    """The pattern of a line; `counts` gets the counts of a table, which the pattern's groups match."""
    pattern, end = "", 0
    for each in _VARYING.finditer(line):
        if each["anything"] or is_clocked:
            pattern += re.escape(line[end : each.start()])
            pattern += {"anything": ".*", "measured": "[0-9][0-9:.]*", "count": "([0-9]+)"}[each.lastgroup]
            end = each.end()
            counts += [int(each["count"])] if each["count"] else []
    pattern += re.escape(line[end:]) + "\n"
    if is_clocked and _LOGGED.match(line):  # on a busy machine a run lasts longer, and logs it more often
        pattern += "(?:" + _NUMBER.sub("[0-9.]+", re.escape(line)) + "\n)*"
    return pattern


def aligned(line):
    """The line with two spaces between its columns: how wide they are depends on where the project lies."""
    return re.sub(r"(?<=\S) {2,}", "  ", line.rstrip())


def imported_plugins():
    return [name for name in sys.modules if name.partition(".")[0] == "plugins"]


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A copy of the project as the current folder, whose own `plugins` are imported."""
    for part in ("configs", "plugins"):
        shutil.copytree(PROJECT / part, tmp_path / part, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "tests").mkdir()
    for file in ("pyproject.toml", "tests/conftest.py", "tests/extras.py", "tests/golden.py"):
        shutil.copy(PROJECT / file, tmp_path / file)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.syspath_prepend(tmp_path)
    for name in imported_plugins():
        monkeypatch.delitem(sys.modules, name)
    yield tmp_path
    for name in imported_plugins():
        del sys.modules[name]


@pytest.mark.timeout(300)
@pytest.mark.usefixtures("project")
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=name, marks=pytest.mark.long if name in PAGES_WITH_MANY_RUNS else ())
        for page in PAGES
        for name in [page.relative_to(PROJECT).as_posix()]
    ],
)
def test_the_snippets_of(page):
    document = Document.parse(str(page), snippets)
    document.namespace["__name__"] = "__main__"
    with ExitStack() as runs, asyncio.Runner() as runner:
        document.namespace.update(runner=runner, runs=runs)
        for example in document.examples():
            example.evaluate()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(PROJECT)))
def test_links_between_pages_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text("utf-8")):
        assert target.startswith("https://") or (page.parent / target).exists(), target


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(PROJECT)))
def test_paragraph_above_a_file_names_it(page):
    """A page that is rendered does not show the title of a block."""
    text = page.read_text("utf-8")
    for block in re.finditer(r'^(?:<!--.*-->\n)?```\w+ title="(.+)"$', text, re.MULTILINE):
        paragraph = text[: block.start()].rstrip().rpartition("\n\n")[2]
        assert f"`{block[1]}`" in paragraph


def test_no_page_overwrites_a_file_of_another():
    pages = Counter(
        title
        for page in PAGES
        for title in set(re.findall(r'^```\w+ title="(.+)"$', page.read_text("utf-8"), re.MULTILINE))
    )
    assert [title for title, count in pages.items() if count > 1] == []


def test_pip_commands_install_from_the_clone():
    sources = [
        path
        for part in ("busflow", "plugins", "benchmarks", "ui", "assistant")
        for path in (PROJECT / part).rglob("*.py")
    ]
    files = [*PAGES, PROJECT / "CHANGELOG.md", *(PROJECT / "busflow/cli/templates").iterdir(), *sources]
    asked = re.compile(r"""pip install (-\S+ )*["']?busflow""")
    assert [str(path) for path in files if path.is_file() and asked.search(path.read_text("utf-8"))] == []


def test_page_on_commands_names_every_public_name():
    page = (PROJECT / "docs/commands.md").read_text("utf-8")
    rows = re.findall(r"^\| (`.*?) \| (.*) \|$", page, re.MULTILINE)
    assert sorted(name for row, _ in rows for name in re.findall(r"`(\w+)`", row)) == sorted(commands.__all__)
    members = next(re.findall(r"`(\w+)`", text)[1:] for row, text in rows if row == "`Peer`")
    assert set(members) <= {*dir(commands.Peer), "run"}


def modules_of_the_reference():
    page = (PROJECT / "docs/reference.md").read_text("utf-8")
    return re.findall(r"^\| `(busflow[\w.]*)` \|", page, re.MULTILINE)


def snippets_of_the_pages():
    text = "".join(page.read_text("utf-8") for page in PAGES if page.parent.name != "decisions")
    return "".join(re.findall(r"^```python.*\n((?:.*\n)*?)```", text, re.MULTILINE)), text


def test_every_public_name_stands_on_a_page():
    snippets, text = snippets_of_the_pages()
    words = set(re.findall(r"\w+", snippets + " ".join(re.findall(r"`[^`\n]+`", text))))
    names = {name for module in modules_of_the_reference() for name in getattr(import_module(module), "__all__", ())}
    assert names - words == set()


def test_the_pages_import_what_the_reference_lists():
    imported = set(re.findall(r"^(?:from|import) (busflow[\w.]*)", snippets_of_the_pages()[0], re.MULTILINE))
    assert {name for name in imported if not name.startswith("busflow.msgs.")} <= {*modules_of_the_reference()}


def test_the_page_on_launch_files_names_every_key():
    page = (PROJECT / "docs/launch-files.md").read_text("utf-8")
    sections = [each for each in vars(model).values() if isinstance(each, type) and issubclass(each, model.Section)]
    keys = {key for section in sections for key in section.model_fields}
    keys |= {key.removesuffix("_s") for key in QoS.model_fields}
    assert {key for key in keys if f"`{key}`" not in page} == set()
    assert {name for name in PRESETS if f"`{name}`" not in page} == set()


def test_page_on_command_line_names_every_option():
    page = (PROJECT / "docs/command-line.md").read_text("utf-8")
    assert {name for name in COMMANDS if f"## `busflow {name}`" not in page} == set()
    options = {
        option
        for each in run.params
        for option in each.opts
        if option.startswith("-") and not getattr(each, "hidden", False)
    }
    assert {option for option in options if f"`{option}" not in page} == {"--verbose", "-h"}


def layers_enforced() -> list[list[str]]:
    """The layers of the linter's list, from the top, each with its packages and modules."""
    contracts = tomllib.loads((PROJECT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    layers = next(each["layers"] for each in contracts if each["type"] == "layers")
    return [re.findall(r"\w+", layer) for layer in layers]


def test_architecture_table_matches_the_linter():
    page = (PROJECT / "docs/architecture.md").read_text("utf-8")
    rows = re.findall(r"^\| (`.*?) \|", page, re.MULTILINE)
    assert [re.findall(r"`(\w+)/?`", row) for row in rows] == layers_enforced()


def test_architecture_picture_matches_the_linter():
    picture = ET.parse(PROJECT / "docs/architecture.svg")  # noqa: S314  # a file of this project
    svg = "{http://www.w3.org/2000/svg}"
    drawn = [each for each in picture.iter(f"{svg}g") if each.get("class") == "layer"]
    heights = [float(each.find(f"{svg}rect").get("y")) for each in drawn]
    assert heights == sorted(heights)
    assert [[name.text for name in each.iter(f"{svg}text") if name.get("class") == "name"] for each in drawn] == (
        layers_enforced()
    )


def test_the_architecture_page_is_two_screens():
    assert len((PROJECT / "docs/architecture.md").read_text("utf-8").splitlines()) <= 100
