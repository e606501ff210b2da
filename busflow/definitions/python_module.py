"""The Python module of a package: its types as the classes that a person would write."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, isnan

from busflow.definitions.definition import DefinedConstant, DefinedField, Kind, MessageDefinition, TypeDefinition
from busflow.definitions.python_text import all_names, docstring, imports, literal
from busflow.errors import Place
from busflow.interfaces.encoding.description import PRIMITIVES, Count
from busflow.text import counted

_HOME = "busflow.interfaces.message"
_BASES = {Kind.MESSAGE: "Message", Kind.SERVICE: "ServiceType", Kind.ACTION: "ActionType"}
_WORDS = {"bool": "bool", "string": "str"}
"""Python's own words for a type of ROS 2."""
_ELSEWHERE = {
    "ActionType": "busflow.interfaces.action",
    "Annotated": "typing",
    "ClassVar": "typing",
    "Sequence": "collections.abc",
    "bool": "builtins",
    "inf": "math",
    "nan": "math",
    "str": "builtins",
}
_ARRAYS = {name: f"{name.title().replace('Uint', 'UInt')}Array" for name, each in PRIMITIVES.items() if each.size}
_RESERVED = {*_BASES.values(), *_ELSEWHERE, *_ARRAYS.values(), "Length"}
"""The words of the language of types that a message may have as its name."""


@dataclass(frozen=True, slots=True)
class Sources:
    """What a module was made of: the command, the package's version and licence, and the hash of each type."""

    command: str
    origin: str
    hashes: Mapping[str, str]


def module_text(
    package: str, definitions: Sequence[TypeDefinition], home: Callable[[str, Place | None], str], sources: Sources
) -> str:
    """Return the source of a module.

    Args:
        package: Its name.
        definitions: Its types.
        home: Returns the module of a package that its types need.
        sources: What the head of the file states.

    Raises:
        InvalidDefinition: A type cannot be a class; the problem says which and why.
    """
    return "\n".join(_Module(package, definitions, home).lines(sources)) + "\n"


class _Module:
    """A module while it is written: what its classes import."""

    def __init__(
        self, package: str, definitions: Sequence[TypeDefinition], home: Callable[[str, Place | None], str]
    ) -> None:
        self._package, self._home = package, home
        self._definitions = _ordered(definitions)
        self._inside = _hidden_by_another(self._definitions)
        self._own = {each.short for each in definitions} | {str(each.kind) for each in self._inside}
        parts = [part for each in definitions for part in each.parts]
        self._names = {one.field.name for part in parts for one in part.fields}
        self._names |= {one.name for part in parts for one in part.constants}
        self._imports: defaultdict[str, set[str]] = defaultdict(set)

    def lines(self, sources: Sources) -> Iterator[str]:
        """Yield the lines of the module."""
        outside = [each for each in self._definitions if each not in self._inside]
        classes = [line for each in outside for line in ("", "", *self._class(each, 0), *self._alias(each))]
        classes += [line for kind in Kind for line in self._namespace(kind)]
        kinds = [(kind, sum(each.kind is kind for each in self._definitions)) for kind in Kind]
        held = ", ".join(counted(count, kind.noun) for kind, count in kinds if count)
        yield from docstring(f"`{self._package}`: {held}, from its definition files.", 0)
        yield ""
        yield from _head(sources)
        yield ""
        yield from imports(self._imports)
        yield from all_names(self._own)
        yield from classes

    def _alias(self, definition: TypeDefinition) -> Iterator[str]:
        """Yield another name for a message where a constant with its own name would hide it."""
        if definition.kind is Kind.MESSAGE and definition.short in self._names:
            yield from ("", "", f"_{definition.short} = {definition.short}")

    def _namespace(self, kind: Kind) -> Iterator[str]:
        """Yield a class around the types of a kind whose names others have: `control_msgs.action.GripperCommand`."""
        inside = [each for each in self._inside if each.kind is kind]
        if inside:
            yield from ("", "", f"class {kind}:")
            yield f'    """Types whose names other types of `{self._package}` have too."""'
        for each in inside:
            yield from ("", *self._class(each, 1))

    def _class(self, definition: TypeDefinition, depth: int) -> Iterator[str]:
        """Yield the lines of a class at a depth of indentation."""
        base, indent = self._word(_BASES[definition.kind]), "    " * depth
        yield f'{indent}class {definition.short}({base}, package="{self._package}"):'
        if definition.kind is Kind.MESSAGE:
            (part,) = definition.parts
            yield from self._body(part, definition.comment or f"The message `{definition.name}`.", depth + 1)
            return
        yield from docstring(definition.comment or f"The {definition.kind.noun} `{definition.name}`.", depth + 1)
        for part in definition.parts:
            word = part.name.rpartition("_")[2]
            yield ""
            yield f"{indent}    class {word}({self._word('Message')}):"
            yield from self._body(part, part.comment or f"The {word.lower()}.", depth + 2)

    def _body(self, part: MessageDefinition, comment: str, depth: int) -> Iterator[str]:
        indent = "    " * depth
        yield from docstring(comment, depth)
        for declared in (part.constants, part.fields):
            if declared:
                yield ""
            for each in declared:
                text = self._constant(each) if isinstance(each, DefinedConstant) else self._field(each)
                yield f"{indent}{text}"
                if each.comment:
                    yield from docstring(each.comment, depth)

    def _constant(self, constant: DefinedConstant) -> str:
        return f"{constant.name}: {self._word('ClassVar')}[{self._word(constant.base)}] = {self._value(constant.value)}"

    def _field(self, defined: DefinedField) -> str:
        return f"{defined.field.name}: {self._annotation(defined)} = {self._default(defined)}"

    def _annotation(self, defined: DefinedField) -> str:
        field = defined.field
        if field.count is Count.ONE:
            return self._one(defined)
        if not field.nested and PRIMITIVES[field.base].size:
            many = self._word(_ARRAYS[field.base])
        else:
            many = f"{self._word('Sequence')}[{self._one(defined)}]"
        if field.count is Count.UNBOUNDED:
            return many
        limit = field.size if field.count is Count.FIXED else f"max={field.size}"
        return f"{self._word('Annotated')}[{many}, {self._word('Length')}({limit})]"

    def _one(self, defined: DefinedField) -> str:
        """Return the annotation of one value."""
        field = defined.field
        if field.nested:
            return self._message(defined)
        word = self._word(_WORDS.get(field.base, field.base))
        if not field.string_bound:
            return word
        return f"{self._word('Annotated')}[{word}, {self._word('Length')}(max={field.string_bound})]"

    def _default(self, defined: DefinedField) -> str:
        field, value = defined.field, defined.default
        number = not field.nested and PRIMITIVES[field.base].size > 0
        if field.count is Count.ONE:
            zero = False if field.base == "bool" else 0.0 if field.base.startswith("float") else 0 if number else ""
            return f"{self._message(defined)}()" if field.nested else self._value(zero if value is None else value)
        if number:
            if isinstance(value, tuple):
                return f"{self._word('array')}([{', '.join(map(self._value, value))}])"
            if field.base == "bool" and field.count is Count.FIXED:
                return f"{self._word('array')}([False] * {field.size})"
            return f"{self._word('zeros')}({field.size if field.count is Count.FIXED else ''})"
        if isinstance(value, tuple):
            return "()" if not value else f"({', '.join(map(self._value, value))},)"
        one = f"{self._message(defined)}()" if field.nested else '""'
        return f"({one},) * {field.size}" if field.count is Count.FIXED else "()"

    def _value(self, value: object) -> str:
        """Return a value as source."""
        if isinstance(value, float) and not isfinite(value):
            return f"{'-' if value < 0 else ''}{self._word('nan' if isnan(value) else 'inf')}"
        return literal(value)

    def _message(self, defined: DefinedField) -> str:
        """Return the name of a message class, imported if it is of another package."""
        package, _, short = defined.field.base.split("/")
        if package == self._package:
            return f"_{short}" if short in self._names else short
        module = self._home(defined.field.base, defined.type_place)
        if short in self._own or self._is_taken(short, module):
            above, _, name = module.rpartition(".")
            return f"{self._imported(name, above or '.')}.{short}"
        return self._imported(short, module)

    def _is_taken(self, short: str, module: str) -> bool:
        """Return whether another word or class is meant by the name of a class."""
        others = (names for each, names in self._imports.items() if each != module)
        return short in _RESERVED or any({short, f"{short} as _{short}"} & names for names in others)

    def _word(self, word: str) -> str:
        """Return a word of the language of types, imported where it is not Python's own."""
        if word in ("bool", "str") and word not in self._names:
            return word
        return self._imported(word, _ELSEWHERE.get(word, _HOME))

    def _imported(self, word: str, module: str) -> str:
        """Return the name by which a word is imported: another one where the package has that name."""
        hidden = word in self._own or word in self._names
        self._imports[module].add(f"{word} as _{word}" if hidden else word)
        return f"_{word}" if hidden else word


def _head(sources: Sources) -> Iterator[str]:
    yield f"# {sources.command}"
    yield f"# wrote this from {sources.origin}. Change its files instead, and run that again:"
    width = max(map(len, sources.hashes))
    yield from (f"#   {name:{width}}  {found}" for name, found in sources.hashes.items())


def _ordered(definitions: Sequence[TypeDefinition]) -> list[TypeDefinition]:
    """Return the types by name, each behind those of the package that it needs."""
    by_name = {each.name: each for each in definitions}
    done: dict[str, TypeDefinition] = {}

    def add(each: TypeDefinition) -> None:
        for needed, _ in each.needs():
            if needed in by_name and needed not in done:
                add(by_name[needed])
        done.setdefault(each.name, each)

    for name in sorted(by_name, key=lambda each: (list(Kind).index(by_name[each].kind), each)):
        add(by_name[name])
    return list(done.values())


def _hidden_by_another(definitions: Sequence[TypeDefinition]) -> list[TypeDefinition]:
    """Return the types whose last name one before them has: a message keeps it, a service or an action does not."""
    seen = set[str]()
    return [each for each in definitions if each.short in seen or seen.add(each.short)]
