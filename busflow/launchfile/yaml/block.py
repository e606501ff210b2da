"""Writes a value as YAML that can be read back, in block style, with the origin of each scalar as a comment."""

from __future__ import annotations

from collections.abc import Iterator

from busflow.launchfile.yaml.scalar import written
from busflow.launchfile.yaml.value import Value
from busflow.text import printable


def lines(value: Value) -> Iterator[str]:
    """Yield the lines of the YAML, with aligned comments."""
    pairs = list(_block(value, ""))
    width = min(60, max((len(text) for text, origin in pairs if origin), default=0))
    for text, origin in pairs:
        yield f"{text:<{width}}  # from {printable(origin)}" if origin else text


def text_of(value: Value) -> str:
    """Return the YAML without comments."""
    return "".join(f"{text}\n" for text, _ in _block(value, ""))


def origins(value: Value) -> dict[str, str]:
    """Return the origin of each value, by its dotted path."""
    return {".".join(map(str, path)): str(leaf.origin) for path, leaf in value.leaves()}


def _block(value: Value, indent: str) -> Iterator[tuple[str, str]]:
    """Yield lines, each with the origin of its scalar, or an empty text for a line without one."""
    if isinstance(value.content, dict):
        for key, member in value.content.items():
            yield from _member(f"{indent}{written(key)}:", member, indent + "  ")
    elif isinstance(value.content, list):
        for member in value.content:
            yield from _member(f"{indent}-", member, indent + "  ")
    else:
        yield f"{indent}{written(value.content)}", str(value.origin)


def _member(head: str, member: Value, indent: str) -> Iterator[tuple[str, str]]:
    match member.content:
        case dict() | list() as content if content:
            yield head, ""
            yield from _block(member, indent)
        case dict():
            yield f"{head} {{}}", str(member.origin)
        case list():
            yield f"{head} []", str(member.origin)
        case scalar:
            yield f"{head} {written(scalar)}", str(member.origin)
