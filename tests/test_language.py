"""The language of the project: one word for a concept, plain names and docstrings, a test module for each module."""

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from tests.test_structure import GENERATED, PRODUCT, ROOT, name, nodes, tree

PACKAGES = {
    "busflow": ROOT / "tests",
    "ui/busflow_ui": ROOT / "ui/tests",
    "assistant/busflow_assistant": ROOT / "assistant/tests",
}
"""Where each package's tests are; a source distribution has no `ui/` and no `assistant/`."""
MODULES = [path for path in PRODUCT if not path.is_relative_to(ROOT / "plugins")]
TESTS = sorted(path for folder in PACKAGES.values() for path in folder.rglob("test_*.py"))

UNCLEAR = {"told", "tell", "tells", "hear", "hears", "heard", "who", "whoever", "nobody", "somebody"}
METAPHORS = {"crew", "voice", "ear", "ears", "tape", "cast", "company", "doorbell", "bequeath", "eavesdropper"}
ALLOWED: dict[tuple[str, str], str] = {}
"""A file and a name or first line in it that may hold such a word, with the reason."""

NOUNS_BEGIN = {"A", "All", "An", "Each", "Every", "Its", "One", "The", "True", "Whether"}
"""First words of a docstring that begins with a noun, or a condition, in place of a verb."""

NESTED = {"Request", "Response", "Goal", "Result", "Feedback"}
WORDS_OF_A_TEST = 8


def words(text: str) -> Iterator[str]:
    """The words of a name or a sentence, split at `_` and capitals."""
    return (each.lower() for each in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", text))


def names(path: Path) -> Iterator[tuple[int, str]]:
    """Each name that a module gives to something: functions, classes, parameters, variables, attributes."""
    for node in nodes(path):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.lineno, node.name
        elif isinstance(node, ast.arg):
            yield node.lineno, node.arg
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.lineno, node.id
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.lineno, node.attr


def first_lines(path: Path) -> Iterator[tuple[int, str]]:
    """The first line of each docstring, those of attributes too."""
    for node in nodes(path):
        body = node.body if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) else []
        for each in body:
            if isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant):
                yield each.lineno, str(each.value.value).strip().partition("\n")[0]


def public_classes(path: Path) -> Iterator[str]:
    for node in nodes(path):
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield node.name


def test_the_glossary_has_one_row_for_each_word():
    rows = re.findall(r"^\| (\w.*?) \|", (ROOT / "docs/glossary.md").read_text("utf-8"), re.MULTILINE)[1:]
    defined = [word for row in rows for word in row.split(", ")]
    assert 0 < len(rows) <= 40
    assert sorted(set(defined)) == sorted(defined)


def test_no_class_name_stands_twice():
    places: defaultdict[str, list[str]] = defaultdict(list)
    for path in MODULES:
        if "msgs" not in path.parts:
            for each in public_classes(path):
                places[each].append(name(path))
    assert {each: found for each, found in places.items() if len(found) > 1 and each not in NESTED} == {}


def test_names_and_docstrings_use_plain_words():
    found = {
        (name(path), text): line
        for path in MODULES
        if GENERATED not in path.read_text(encoding="utf-8")  # the words are those of definition files
        for line, text in [(1, path.stem), *names(path), *first_lines(path)]
        if (UNCLEAR | METAPHORS) & set(words(text))
    }
    assert [f"{path}:{line} {text}" for (path, text), line in found.items() if (path, text) not in ALLOWED] == []
    assert ALLOWED.keys() - found.keys() == set(), "an exception that nothing needs any more"


def test_docstrings_of_functions_begin_with_a_verb():
    """A noun stands for a value: that of a property, an attribute or a constant."""
    found = {
        f"{name(path)}:{node.lineno} {node.name}"
        for path in PRODUCT
        for node in nodes(path)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and not any("property" in ast.unparse(each) for each in node.decorator_list)
        and (ast.get_docstring(node) or "").partition(" ")[0] in NOUNS_BEGIN
    }
    assert found == set()


def names_of_tests() -> Iterator[tuple[str, str]]:
    """The place and the name of each test."""
    for path in TESTS:
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if found := re.match(r" *(?:async )?def (test_\w+)\(", line):
                yield f"{name(path)}:{number}", found[1]


def test_names_of_tests_use_plain_words():
    assert [each for each in names_of_tests() if UNCLEAR & set(words(each[1]))] == []


def test_names_of_tests_have_eight_words_at_most():
    assert [each for each in names_of_tests() if len(each[1].split("_")) - 1 > WORDS_OF_A_TEST] == []


def test_each_module_has_a_test_module():
    """`bus/topic.py` has `bus/test_topic.py`; small modules may share the one of their package, which names them."""
    missing: list[str] = []
    for package, tests in PACKAGES.items():
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
