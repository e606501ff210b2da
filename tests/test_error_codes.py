"""Tests of the codes in `docs/errors.toml`, from which `docs/errors.md` is made: each code is there, and is reached.

An example is a launch file (`yaml`), a robot's description (`urdf`), a definition file (`msg`), a Python snippet, or a
command beside `files`; it is run, and gives its code. A code that needs a crash or another machine names its `test`.
"""

import ast
import asyncio
import inspect
import json
import re
import shlex
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from busflow import errors
from busflow.cli import _COMMANDS as COMMANDS
from busflow.cli.root import Root
from busflow.errors import BusflowError
from tests.golden import section, sections

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/errors.md"
REGISTRY: dict[str, dict[str, dict[str, Any]]] = tomllib.loads((ROOT / "docs/errors.toml").read_text("utf-8"))
INTRODUCTION = REGISTRY.pop("page")
CODES = {code: entry for section in REGISTRY.values() for code, entry in section.items()}
SOURCES = [path for folder in ("busflow", "ui/busflow_ui") for path in (ROOT / folder).rglob("*.py")]
CLASSES = [each for _, each in inspect.getmembers(errors, inspect.isclass) if issubclass(each, BusflowError)]
NEVER_ALONE = {"PluginError", "InvalidInput", "ServiceError", "ActionError", "TransformError"}
"""The classes that are never raised with a code of their own: their subclasses and their problems have one."""
OF_CLASSES = {each.code: each for each in CLASSES if each.__name__[0] != "_" and each.__name__ not in NEVER_ALONE}
KINDS = {
    "yaml": ("lab.yaml", "busflow check -v lab.yaml --json"),
    "urdf": ("arm.urdf", "busflow check lab.yaml --json"),
    "msg": ("my_robot/msg/Box.msg", "busflow interface show my_robot/msg/Box --interfaces ."),
}
"""By kind, the file that an example is, and the command that reads it."""
DESCRIBED = "nodes: {robot: {plugin: robot_state_publisher, parameters: {description: arm.urdf}}}"
FUNCTIONS = ast.FunctionDef | ast.AsyncFunctionDef
KEBAB = re.compile("[a-z0-9]+(-[a-z0-9]+)*")


def test_each_code_stands_in_one_section():
    assert len(CODES) == sum(map(len, REGISTRY.values()))
    assert [code for code in CODES if not KEBAB.fullmatch(code)] == []


def codes_in_source() -> set[str]:
    """The codes that the source writes out, as an argument or a variable `code`; others are composed of two words."""
    texts = {path: path.read_text("utf-8") for path in SOURCES if "msgs" not in path.parts}
    nodes = {path: [*ast.walk(ast.parse(text))] for path, text in texts.items() if "code" in text or "roblem" in text}
    places: dict[tuple[Path, str], int] = {}
    for path, each in ((path, node) for path, found in nodes.items() for node in found):
        if isinstance(each, ast.FunctionDef):
            names = [arg.arg for arg in each.args.args if arg.arg != "self"]
            if "code" in names:
                places[path.parent if each.name[0] == "_" else ROOT, each.name] = names.index("code")
    found: set[str] = set()
    for path, its_nodes in nodes.items():
        known = {name: place for (where, name), place in places.items() if where in (ROOT, path.parent)}
        for value in (value for node in its_nodes for value in values(node, known)):
            parts = [value.body, value.orelse] if isinstance(value, ast.IfExp) else [value]
            found |= {each.value for each in parts if isinstance(each, ast.Constant) and isinstance(each.value, str)}
    return {each for each in found if KEBAB.fullmatch(each)}


def values(node: ast.AST, places: dict[str, int]) -> Iterator[ast.expr]:
    """The expressions that a node gives to a variable or a parameter `code`."""
    match node:
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=given):
            place = 0 if name == "Problem" else places.get(name, len(given))
            yield from given[place : place + 1]
        case ast.Assign(targets=[ast.Name(id="code")], value=value):
            yield value
        case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple(elts=found)):
            yield from (value for target, value in zip(targets, found, strict=True) if ast.unparse(target) == "code")
        case _:
            return


def test_registry_has_each_code_of_the_source():
    assert sorted((codes_in_source() | OF_CLASSES.keys()) - CODES.keys()) == []


@pytest.mark.parametrize("code", [code for code, entry in CODES.items() if "test" not in entry])
def test_example_gives_its_code(code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys):
    monkeypatch.chdir(tmp_path)
    entry = CODES[code]
    files = files_of(entry) | ({"lab.yaml": DESCRIBED} if "urdf" in entry else {})
    if not any(name.startswith("plugins/") for name in files):
        (tmp_path / "plugins").symlink_to(ROOT / "plugins")
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, "utf-8")
    usual = next((command for kind, (_, command) in KINDS.items() if kind in entry), "")
    found = given_by(entry.get("python", ""))
    for line in entry.get("command", "" if "python" in entry else usual).splitlines():
        found += shown_by(line, monkeypatch, capsys)
    assert code in found, found


def files_of(entry: dict[str, Any]) -> dict[str, str]:
    """The files of an example by their names."""
    files = {name: entry[kind] for kind, (name, _) in KINDS.items() if kind in entry} | entry.get("files", {})
    return {name: f"plugins: [plugins]\n{text}" if "{plugin: " in text else text for name, text in files.items()}


def shown_by(line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """The codes of the error that a command raises, or of what it prints as JSON; a line may begin with variables."""
    words = shlex.split(line)
    while "=" in words[0]:
        monkeypatch.setenv(*words.pop(0).split("="))
    if words[0] != "busflow":
        subprocess.run(words, check=True)
        return []
    root = Root(COMMANDS, {}, help="", context_settings={"help_option_names": ["-h", "--help"]})  # as in `main`
    capsys.readouterr()
    try:
        with root.make_context("busflow", words[1:]) as context:
            root.invoke(context)
    except BusflowError as error:
        return carried_by(error)
    return re.findall(r'"code": "([^"]+)"', capsys.readouterr().out)


def given_by(snippet: str) -> list[str]:
    """The codes of the error that a snippet raises."""
    code = compile(snippet, "example.py", "exec", flags=ast.PyCF_ALLOW_TOP_LEVEL_AWAIT)
    try:
        if (waiting := eval(code, {"__name__": "example"})) is not None:  # noqa: S307  # our own page
            asyncio.run(waiting)
    except BusflowError as error:
        return carried_by(error)
    return []


def carried_by(error: BaseException | None) -> list[str]:
    """The codes of an error, of all that it carries, and of its causes."""
    if not isinstance(error, BusflowError):
        return []
    carried = re.findall(r'"code": "([^"]+)"', json.dumps(error.as_json()))
    return [error.code, *carried, *carried_by(error.__cause__)]


@pytest.mark.parametrize("code", [code for code, entry in CODES.items() if "test" in entry])
def test_named_test_knows_the_code(code: str):
    path, _, name = CODES[code]["test"].partition("::")
    functions = [each for each in ast.walk(ast.parse((ROOT / path).read_text("utf-8"))) if isinstance(each, FUNCTIONS)]
    (text,) = [ast.unparse(each) for each in functions if each.name == name]
    file, wanted = section(ROOT / path, name)
    written = "".join(text for title, text in sections(file).items() if re.split(r"\[|: ", title)[0] == wanted)
    names = {repr(code), OF_CLASSES[code].__name__ if code in OF_CLASSES else code}
    assert any(each in text for each in names) or re.search(rf"(?<![\w-]){code}[];: ]", written)


def made() -> str:
    """The page."""
    lines = ["# Error codes", "", INTRODUCTION["text"].strip()]
    for title, entries in REGISTRY.items():
        lines += ["", f"## {title}"]
        for code, entry in sorted(entries.items()):
            lines += ["", f"### `{code}`", "", meaning(code, entry)]
            lines += [line for block in blocks(entry) for line in ("", *block)]
    return "\n".join(lines) + "\n"


def meaning(code: str, entry: dict[str, Any]) -> str:
    text = entry.get("meaning") or inspect.cleandoc(OF_CLASSES[code].__doc__ or "").partition("\n")[0]
    return f"{text} {entry.get('example', '')}".strip()


def blocks(entry: dict[str, Any]) -> Iterator[list[str]]:
    """The blocks of an example: its files, and the command."""
    for name, text in files_of(entry).items():
        language = {".yaml": "yaml", ".py": "python", ".urdf": "xml"}.get(Path(name).suffix, "text")
        yield [f"`{name}`:", "", f"```{language}", *text.strip("\n").split("\n"), "```"]
    if "python" in entry:
        yield ["```python", *entry["python"].strip("\n").split("\n"), "```"]
    if "command" in entry:
        yield ["```console", *(f"$ {line}" for line in entry["command"].splitlines()), "```"]


def test_page_is_made_from_the_registry(request: pytest.FixtureRequest):
    if request.config.getoption("--update"):
        PAGE.write_text(made(), "utf-8")
    assert PAGE.read_text("utf-8") == made(), "if this is meant: pytest --update"
