"""Expression language of `${…}` and `--filter`: compares and combines values; a filter also calculates.

This module defines numbers, texts and names. Everything else is Python's grammar, with its precedence and its chained
comparisons. Python's parser gets the operators, and `_` in place of each value: no text of a user reaches it, and
nothing is ever evaluated as code.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NoReturn, TypeAlias, cast

from busflow.text import did_you_mean, printable

MAX_LENGTH = 1000
"""Most characters in one expression."""
MAX_DEPTH = 32

Evaluate: TypeAlias = Callable[[Any], Any]
"""Function that computes a part of an expression: in a filter from a message, in a launch file from nothing."""

_NUMBER = r"-?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_TEXT = r"'[^']*'|\"[^\"]*\""
_SIGN = r"[=!<>]=|[-+*/%<>()\[\],}]|not\s+in\b|(?:and|or|not|in)\b"
_WORD_SIGNS = {"and", "or", "not", "in"}
_PREFIXES = {"not", "-", "+"}
_BEFORE_NOT = {"", "(", "[", ",", "and", "or", "not"}
_WORDS = {"true": True, "false": False, "null": None, "True": True, "False": False, "None": None}
_UNCLOSED = dict.fromkeys("'\"", "a quote is never closed")
_ADVICE = {"=": "for equality write ==", "&": "write and", "|": "write or", "!": "write not"}


class InvalidExpression(ValueError):
    """Invalid expression, or wrong types of its values; `start` is the number of characters before the mistake."""

    def __init__(self, message: str, fix: str | None, start: int, width: int = 1) -> None:
        self.message: str = message
        self.fix: str | None = fix
        self.start: int = start
        self.width: int = width
        super().__init__(message)


@dataclass(frozen=True, slots=True)
class Dialect:
    """Differences between the expressions of a launch file and of a filter."""

    names: str
    """Regular expression for names, without groups."""
    resolve: Callable[[str, int], Evaluate]
    """Looks up a name that begins at a position in the text; raises if it is unknown."""
    number: Callable[[str], float]
    """Reads a number; raises ValueError if it is too large."""
    shown: Callable[[object], str]
    """Formats a value for errors."""
    closing: str = ""
    """Character that ends an expression; empty: the end of the text."""
    calculates: bool = False
    """Whether `+ - * / %` and functions are allowed."""


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed expression."""

    evaluate: Evaluate
    """Computes its value; raises InvalidExpression for wrong types, LookupError for missing values."""
    end: int
    """Position in the text after the expression."""
    is_operand: bool
    """Whether it is only a name or a literal."""


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    start: int

    def fail(self, message: str, fix: str | None = None) -> NoReturn:
        raise InvalidExpression(message, fix, self.start, max(1, len(self.text)))


def parse(text: str, dialect: Dialect, start: int = 0) -> Expression:
    """Parse the expression that begins at `start`.

    >>> numbers = Dialect("[a-z]+", lambda name, _: lambda scope: scope[name], int, repr)
    >>> parse("1 < x <= 3 and not y", numbers).evaluate({"x": 3, "y": False})
    True

    Raises:
        InvalidExpression: It is not an expression, or too large.
    """
    reader = _Reader(text, dialect, start)
    reader.read()
    root = ast.parse(reader.shape, mode="eval").body
    evaluate = _Compiler(reader.tokens, reader.operands, dialect.shown).value(root)
    return Expression(evaluate, reader.end, isinstance(root, ast.Name))


class _Reader:
    """Reads and checks tokens, so that Python's parser always gets a valid expression."""

    def __init__(self, text: str, dialect: Dialect, start: int) -> None:
        self._text, self._dialect = text, dialect
        # A stack: the closing sign of each open bracket, and above it the prefixes of the next value.
        self._nesting = [dialect.closing]
        self._last = ""
        self.end = start
        self.shape = ""
        """The expression for Python's parser."""
        self.tokens: dict[int, _Token] = {}
        """The token of each word in the shape, by its column there."""
        self.operands: dict[int, Evaluate] = {}

    def read(self) -> None:
        """Read to the end of the expression."""
        start, value_due = self.end, True
        while self._nesting:
            token = self._next(value_due=value_due)
            if self.end - start > MAX_LENGTH + len(self._dialect.closing):
                message = f"an expression has at most {MAX_LENGTH} characters"
                raise InvalidExpression(message, "make it shorter", start)
            value_due = self._value(token) if value_due else self._sign(token)

    def _next(self, *, value_due: bool) -> _Token:
        found = _pattern(self._dialect.names, calculates=self._dialect.calculates, value_due=value_due).match(
            self._text, self.end
        )
        if found is not None:
            self.end = found.end()
            kind = found.lastgroup or ""
            text = " ".join(found[kind].split()) if kind == "sign" else found[kind]  # `not  in` is `not in`
            return _Token("sign" if text in _WORD_SIGNS else kind, text, found.start(kind))
        rest = self._text[self.end :].lstrip()
        self.end = len(self._text) - len(rest)
        if not rest:
            return _Token("end", "", self.end)
        what = f"{printable(rest[0])!r} is not part of the language"
        raise InvalidExpression(_UNCLOSED.get(rest[0], what), _ADVICE.get(rest[0]), self.end)

    def _value(self, token: _Token) -> bool:
        """Take a token where a value is due; return whether a value is due after it."""
        match token.kind, token.text:
            case (("number" | "text" | "name"), _):
                self.operands[len(self.shape)] = self._operand(token)
                self._put(token, "_")
                return False
            case "function", name:
                if name not in _FUNCTIONS:
                    token.fail(f"there is no function {name}", did_you_mean(name, _FUNCTIONS))
                self._put(token, "_")
            case _, "(":
                self._nest(token, ")")
            case _, "[":
                self._nest(token, "]")
            case _, "]" if self._last in ("[", ","):
                return self._sign(token)
            case _, "not" if self._last in _BEFORE_NOT:
                self._nest(token, "not")
            case _, "-" | "+" if self._dialect.calculates:
                self._nest(token, token.text)
            case _:
                self._unexpected(token, "a value is missing")
        return True

    def _operand(self, token: _Token) -> Evaluate:
        if token.kind == "name" and token.text not in _WORDS:
            return self._dialect.resolve(token.text, token.start)
        value: object = _WORDS.get(token.text, token.text[1:-1])
        if token.kind == "number":
            try:
                value = self._dialect.number(token.text)
            except ValueError as error:
                token.fail(str(error))
        return lambda _: value

    def _sign(self, token: _Token) -> bool:
        """Take a token after a value; return whether a value is due after it."""
        while self._nesting[-1] in _PREFIXES:
            self._nesting.pop()
        closing, calculates = self._nesting[-1], token.text in _CALCULATIONS
        if token.text == closing:
            self._nesting.pop()
            if self._nesting:
                self._put(token, closing)
            return False
        if token.text == "not":
            self._unexpected(self._next(value_due=True), "'in' is missing")
        known = self._dialect.calculates if calculates else token.text in _JOINING
        if not known and not (token.text == "," and closing == "]"):
            self._unexpected(token, f"'{closing}' is missing" if closing else "")
        self._put(token, token.text)
        return True

    def _put(self, token: _Token, word: str) -> None:
        self.tokens[len(self.shape)] = token
        self.shape += f"{word} "
        self._last = word

    def _nest(self, token: _Token, closing: str) -> None:
        self._nesting.append(closing)
        if len(self._nesting) > MAX_DEPTH + 1:
            raise InvalidExpression(f"an expression nests at most {MAX_DEPTH} levels", "make it simpler", self.end)
        self._put(token, token.text)

    def _unexpected(self, token: _Token, missing: str) -> NoReturn:
        if token.kind == "end":
            token.fail(missing)
        found = repr(printable(token.text, limit=60))
        fix = None
        if token.text in _CALCULATIONS and not self._dialect.calculates:
            fix = "an expression compares and combines, it does not calculate"
        token.fail(f"{missing} before {found} in the expression" if missing else f"{found} is not expected here", fix)


@cache
def _pattern(names: str, *, calculates: bool, value_due: bool) -> re.Pattern[str]:
    """Return the pattern of the next token; where a value is due, `-1` is a number, and `in[0]` may be a name."""
    function = rf"(?P<function>(?:{names})(?=\s*\())|" if calculates else ""
    sign, value = rf"(?P<sign>{_SIGN})", rf"(?P<number>{_NUMBER})|(?P<text>{_TEXT})|{function}(?P<name>{names})"
    return re.compile(rf"\s*(?:{value}|{sign})" if value_due else rf"\s*(?:{sign}|{value})")


class _Compiler:
    """Turns the syntax tree of a shape into functions; refuses unknown kinds of nodes."""

    def __init__(
        self, tokens: Mapping[int, _Token], operands: Mapping[int, Evaluate], shown: Callable[[object], str]
    ) -> None:
        self._tokens, self._operands, self._shown = tokens, operands, shown

    def value(self, node: ast.expr) -> Evaluate:
        """Return the function that computes a part of the expression."""
        match node:
            case ast.Name():
                return self._operands[node.col_offset]
            case ast.List():
                items = [self.value(each) for each in node.elts]
                return lambda scope: [item(scope) for item in items]
            case ast.UnaryOp(operand=inner) | ast.Call(func=ast.Name(), args=[inner]):
                sign, operand = self._tokens[node.col_offset], self.value(inner)
                return lambda scope: self._applied(sign, operand(scope))
            case ast.BinOp():
                return self._calculated(node)
            case ast.Compare():
                return self._compared(self._parts([node.left, *node.comparators]))
            case ast.BoolOp():
                return self._combined(self._parts(node.values), stop=isinstance(node.op, ast.Or))
            case _:
                raise InvalidExpression(f"{type(node).__name__} is not part of the language", None, 0)

    def _parts(self, nodes: Sequence[ast.expr]) -> list[tuple[_Token, Evaluate]]:
        """Return the values of a chain, each with the sign before it, the first with the sign after it."""
        signs = [self._sign_after(each) for each in nodes[:-1]]
        return list(zip([signs[0], *signs], map(self.value, nodes), strict=True))

    def _sign_after(self, node: ast.expr) -> _Token:
        """Return the sign after a value; Python's nodes do not have the positions of signs and parentheses."""
        column = cast("int", node.end_col_offset) + 1
        while self._tokens[column].text == ")":
            column += 2
        return self._tokens[column]

    def _combined(self, parts: Sequence[tuple[_Token, Evaluate]], *, stop: bool) -> Evaluate:
        return lambda scope: stop if any(self._truth(part(scope), sign) is stop for sign, part in parts) else not stop

    def _compared(self, parts: Sequence[tuple[_Token, Evaluate]]) -> Evaluate:
        (_, first), *others = parts

        def compared(scope: Any) -> bool:
            left = first(scope)
            for sign, other in others:
                right = other(scope)
                if not self._holds(sign, left, right):
                    return False
                left = right
            return True

        return compared

    def _calculated(self, node: ast.expr) -> Evaluate:
        nodes: list[ast.expr] = []
        while isinstance(node, ast.BinOp):  # make one function of a whole chain such as `a + b - c`
            nodes.append(node.right)
            node = node.left
        (_, first), *others = self._parts([node, *reversed(nodes)])

        def calculated(scope: Any) -> Any:
            result = first(scope)
            for sign, other in others:
                numbers = self._number(result, sign), self._number(other(scope), sign)
                try:
                    result = _CALCULATIONS[sign.text](*numbers)
                except OverflowError:  # integers too large for a float
                    result = math.inf
            return result

        return calculated

    def _applied(self, sign: _Token, value: Any) -> Any:
        """Apply a prefix or a function to a value."""
        match sign.text:
            case "not":
                return not self._truth(value, sign)
            case "-" | "+":
                return self._number(value, sign) * (-1 if sign.text == "-" else 1)
            case function:
                try:
                    return _FUNCTIONS[function](value)
                except TypeError:
                    sign.fail(f"{function}() cannot take {self._shown(value)}")
                except ValueError:
                    raise LookupError(f"{function}() of an empty sequence") from None

    # Checks of values.

    def _truth(self, value: object, sign: _Token) -> bool:
        if not isinstance(value, bool):
            sign.fail(f"'{sign.text}' needs true or false, got {self._shown(value)}", "compare it with something")
        return value

    def _number(self, value: Any, sign: _Token) -> float:
        if not _is_number(value):
            sign.fail(f"'{sign.text}' calculates with numbers, not with {self._shown(value)}")
        return value

    def _holds(self, sign: _Token, left: Any, right: Any) -> bool:
        if sign.text in ("==", "!="):
            return _equal(left, right) is (sign.text == "==")
        if sign.text not in _ORDERS:
            return self._within(sign, left, right) is (sign.text == "in")
        if not (_is_number(left) and _is_number(right)) and not (isinstance(left, str) and isinstance(right, str)):
            message = f"'{sign.text}' cannot compare {self._shown(left)} with {self._shown(right)}"
            sign.fail(message, "compare like with like")
        return _ORDERS[sign.text](left, right)

    def _within(self, sign: _Token, item: object, container: object) -> bool:
        if isinstance(container, str) and isinstance(item, str):
            return item in container
        if isinstance(container, str) or not isinstance(container, Sequence | memoryview):
            message = f"'in' cannot look for {self._shown(item)} in {self._shown(container)}"
            sign.fail(message, "give it a list: [1, 2]")
        return any(_equal(item, each) for each in cast("Sequence[object]", container))


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _equal(left: object, right: object) -> bool:
    """Compare values; `true` does not equal 1."""
    return isinstance(left, bool) is isinstance(right, bool) and left == right


def _divided(left: float, right: float) -> float:
    """Divide as IEEE 754 defines it."""
    if right:
        return left / right
    return math.nan if not left or math.isnan(left) else math.copysign(math.inf, left)


_ORDERS: dict[str, Callable[[Any, Any], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_CALCULATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": _divided,
    "%": lambda left, right: left % right if right else math.nan,
}
_FUNCTIONS: dict[str, Callable[[Any], Any]] = {"len": len, "abs": abs, "min": min, "max": max}
_JOINING = {"and", "or", "in", "not in", "==", "!=", *_ORDERS}
