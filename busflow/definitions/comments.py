"""CommentBlocks of a definition file: which declaration, part or file each belongs to."""

from __future__ import annotations

import textwrap


class CommentBlocks:
    """The comment lines since the last declaration, in blocks that empty lines part."""

    def __init__(self) -> None:
        self._blocks: list[list[str]] = [[]]

    def add(self, line: str) -> None:
        """Append a line, without its `#`."""
        self._blocks[-1].append(line)

    def end_block(self) -> None:
        """Let the next line begin a block of its own."""
        if self._blocks[-1]:
            self._blocks.append([])

    def take(self) -> str:
        """Return all as text, and forget it."""
        blocks, self._blocks = self._blocks, [[]]
        return joined(*map(dedented, blocks))


def joined(*blocks: str) -> str:
    """Return blocks of a comment as one, an empty line between them."""
    return "\n\n".join(block for block in blocks if block)


def dedented(lines: list[str]) -> str:
    """Return lines without what indents all of them, and without empty ones at the ends."""
    return textwrap.dedent("\n".join(lines)).strip("\n").rstrip()
