"""Packages of definition files that hypothesis draws, of every kind and name, and the modules that are made of them."""

from __future__ import annotations

import builtins
import keyword
import sys
from importlib import import_module
from itertools import count
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from busflow.definitions.generator import Generated, generate
from busflow.definitions.library import Library
from busflow.errors import InvalidDefinition
from busflow.interfaces.encoding.description import PRIMITIVES
from busflow.text import UNSAFE

PACKAGES = ["p_msgs", "q_msgs"]
"""The second one's types hold the first one's."""
_HOSTILE = sorted(
    {each for each in [*keyword.softkwlist, *dir(builtins)] if each.islower() and each[0] != "_"}
    | {"self", "cls", "class", "from", "replace", "json", "model_id", "array", "zeros", "inf", "nan", "math", "typing"}
    | {"p_msgs", "q_msgs", "builtin_interfaces", "msg", "srv", "action", "request", "goal", "a", "b", *PRIMITIVES}
)
_TYPES = [
    *("Message", "ServiceType", "ActionType", "Annotated", "ClassVar", "Sequence", "Length", "Float64Array", "Request"),
    *("Goal", "Result", "Feedback", "Time", "Duration", "Header", "IMU", "A", "B2", "String", "Bool", "None", "True"),
]
_TEXT = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cf", "Cs", "Zl", "Zp"]), max_size=8).filter(
    lambda text: not UNSAFE.search(text)
)
_field_names = st.one_of(st.sampled_from(_HOSTILE), st.from_regex(r"[a-z](_?[a-z0-9]){0,5}", fullmatch=True))
_hostile_constants = st.sampled_from([each for each in _TYPES if each.isupper()])
_constant_names = st.one_of(_hostile_constants, st.from_regex(r"[A-Z](_?[A-Z0-9]){0,5}", fullmatch=True))
type_names = st.one_of(st.sampled_from(_TYPES), st.from_regex(r"[A-Z][A-Za-z0-9]{0,4}", fullmatch=True))


def _integers(base: str) -> st.SearchStrategy[str]:
    size = 8 * PRIMITIVES[base].size
    low, high = (-(1 << size - 1), (1 << size - 1) - 1) if base.startswith("int") else (0, (1 << size) - 1)
    forms = st.sampled_from(["{}", "{:+}", "{:#x}", "{:#o}", "{:#b}"])
    return st.builds(lambda form, value: form.format(value), forms, st.integers(low, high))


def _floats(base: str) -> st.SearchStrategy[str]:
    plain = st.floats(width=32 if base == "float32" else 64).map(repr)
    return st.one_of(plain, st.sampled_from(["nan", "-inf", "inf", "+inf", "NaN", "1e-3", ".5", "5.", "-0.0", "3"]))


def _quoted(text: str, quote: str) -> str:
    return quote + text.replace(quote, f"\\{quote}") + quote


def texts(base: str, bound: int = 0, *, in_array: bool = False) -> st.SearchStrategy[str]:
    """Values of a primitive as a file writes them."""
    if base == "bool":
        return st.sampled_from(["true", "false", "1", "0", "True", "FALSE"])
    if PRIMITIVES[base].size:
        return _floats(base) if base.startswith("float") else _integers(base)
    short = _TEXT.map(lambda text: text[: bound or None])
    if in_array:
        short = short.filter(lambda text: not text.endswith("\\"))  # ROS 2 cannot write it
    bare = st.from_regex(r"[a-z!\\]([a-z !\\]*[a-z!\\])?", fullmatch=True).map(
        lambda text: text[: bound or None].rstrip()
    )
    quoted = st.builds(_quoted, short, st.sampled_from("\"'"))
    return quoted if in_array else st.one_of(quoted, bare)


@st.composite
def fields(draw: st.DrawFn, name: str, nested: list[str]) -> str:
    """A field with its type, bounds and default."""
    base = draw(st.sampled_from([*PRIMITIVES, *nested]))
    bound = draw(st.sampled_from([0, 0, 1, 3])) if base.endswith("string") else 0
    count = draw(st.sampled_from(["", "", "[]", "[3]", "[<=3]", "[1]"]))
    declared = f"{base}{f'<={bound}' if bound else ''}{count} {name}"
    if base in nested or draw(st.booleans()):
        return declared
    if not count:
        return f"{declared} {draw(texts(base, bound))}"
    exactly = {"[3]": (3, 3), "[1]": (1, 1)}.get(count, (0, 3))
    items = draw(st.lists(texts(base, bound, in_array=True), min_size=exactly[0], max_size=exactly[1]))
    return f"{declared} [{', '.join(items)}]"


@st.composite
def parts(draw: st.DrawFn, nested: list[str]) -> str:
    """The lines of one part, with comments above and behind its declarations."""
    lines = list[str]()
    names = draw(st.lists(_field_names, max_size=5, unique=True))
    constants = draw(st.lists(_constant_names, max_size=2, unique=True))
    for name in constants:
        base = draw(st.sampled_from([*PRIMITIVES]))
        lines.append(f"{base} {name}={draw(texts(base))}")
    lines += [draw(fields(name, nested)) for name in names]
    comment = st.one_of(st.just(""), _TEXT)
    written = [f"{line}  # {text}" if (text := draw(comment)) else line for line in draw(st.permutations(lines))]
    above = [f"# {text}" for text in draw(st.lists(_TEXT, max_size=2))]
    return "\n".join([*above, *([""] if draw(st.booleans()) else []), *written])


@st.composite
def packages(draw: st.DrawFn) -> dict[str, str]:
    """The files of two packages, by path."""
    files, nested = dict[str, str](), ["builtin_interfaces/Time"]
    for package in PACKAGES:
        known = list(nested)
        for word in draw(st.lists(type_names, min_size=1, max_size=3, unique=True)):
            files[f"{package}/msg/{word}.msg"] = draw(parts(known)) + "\n"
            known.append(draw(st.sampled_from([word, f"{package}/{word}"])))
            nested.append(f"{package}/{word}")
        for kind, number in (("srv", 2), ("action", 3)):
            for word in draw(st.lists(type_names, max_size=1)):
                whole = "\n---\n".join(draw(parts(known)) for _ in range(number))
                files[f"{package}/{kind}/{word}.{kind}"] = f"{whole}\n"
    return files


_numbers = count()


class Made:
    """The modules that are generated for the packages of a library, imported."""

    def __init__(self, sources: Path, folder: Path) -> None:
        self.library = Library([sources])
        self.classes: dict[str, Any] = {}
        self.left_out = set[str]()
        self.bodies: dict[str, str] = {}
        home = folder / f"made_{next(_numbers)}"
        home.mkdir()
        (home / "__init__.py").write_text("")
        packages, made = list[str](), list[Generated]()
        for package in PACKAGES:
            if package in self.library.packages and (found := self._generated(package, packages, home)):
                packages.append(package)
                made.append(found)
        for each in made:
            each.path.write_text(each.text)
            self.left_out |= {problem.message.split()[0] for problem in each.left_out}
            self.bodies[each.path.stem] = each.text[each.text.index("\nfrom ") :]
        sys.path.insert(0, str(folder))
        try:
            modules = {each: import_module(f"{home.name}.{each}") for each in packages}
        finally:
            sys.path.remove(str(folder))
        for name in self.library.names:
            package, kind, word = name.split("/")
            if name not in self.left_out and package in modules:
                inside = getattr(modules[package], kind, None)
                self.classes[name] = getattr(inside, word, None) or getattr(modules[package], word)

    def _generated(self, package: str, others: list[str], home: Path) -> Generated | None:
        """Return the module of a package beside others; None where none of its types can be a class."""
        try:
            return generate(self.library, [package, *others], home)[0]
        except InvalidDefinition as error:
            if any(each.code != "invalid-name" for each in error.problems):
                raise
            self.left_out |= {problem.message.split()[0] for problem in error.problems}
            return None
