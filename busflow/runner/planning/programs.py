"""Checks the commands of programs on this machine: each is there, may be executed, and has its folder."""

from __future__ import annotations

import os
import shlex
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from busflow.launchfile.model.description import ClockMode, LaunchDescription, ProgramSpec
from busflow.launchfile.model.placement import for_machine
from busflow.launchfile.model.problems import problem_at, warning_at
from busflow.launchfile.yaml.scalar import flow_words
from busflow.text import nearest, printable

if TYPE_CHECKING:
    from busflow.errors import Problem

_SPACE = set(" \t\n")


def program_problems(descriptions: Sequence[LaunchDescription], *, simulated: bool) -> Iterator[Problem]:
    """Yield what would keep programs from starting here; on simulated time only that none is started."""
    for description in descriptions:
        mode, programs = description.clock.mode, description.programs
        names = ", ".join(each.name for each in programs)
        if programs and (mode is ClockMode.SIM or (simulated and mode is ClockMode.SYSTEM)):
            text = f"on simulated time no program is started: {names}"
            fix = "nodes do not wait for them; with clock: {mode: follow} a program may be the simulator"
            yield warning_at("programs-left-out", text, fix, programs[0].origin)
        elif programs and not hasattr(os, "killpg"):
            text = f"programs need POSIX, and this system is not: {names}"
            yield problem_at("no-posix", text, "on Windows, run busflow in WSL", programs[0].origin)
        else:
            for program in programs:
                yield from for_machine(description.here, program, list(_problems(program)))


def _problems(program: ProgramSpec) -> Iterator[Problem]:
    if not program.cwd.is_dir():
        what = "is not a folder" if program.cwd.exists() else "does not exist"
        text = f"{program.name}: its folder {printable(program.cwd)} {what}"
        yield problem_at(
            "no-folder", text, "create it, or correct cwd; without it, the file's own folder", program.cwd_origin
        )
        return
    word = program.command[0]
    if os.sep in word:
        yield from _at_path(program, program.cwd / word)
    elif shutil.which(word, path=search_path(program)) is None:
        yield _not_found(program, word)


def _at_path(program: ProgramSpec, path: Path) -> Iterator[Problem]:
    if not path.exists():
        near = nearest(path.name, _files(path.parent))
        fix = "correct the path; it begins at cwd"
        if near is not None:
            fix = f"did you mean {printable(str(path.parent / near))!r}?"
        text = f"{program.name}: {printable(path)} does not exist"
        yield problem_at("unknown-command", text, fix, program.command_origin)
    elif path.is_dir() or not os.access(path, os.X_OK):
        text = f"{program.name}: {printable(path)} {'is a folder' if path.is_dir() else 'is not executable'}"
        fix = "name the program in it" if path.is_dir() else f"chmod +x {shlex.quote(str(path))}"
        yield problem_at("not-executable", text, printable(fix), program.command_origin)


def _not_found(program: ProgramSpec, word: str) -> Problem:
    """Return the problem of a command that no folder of PATH has, with the most likely correction."""
    text = f"{program.name}: there is no command {printable(word)!r} on PATH"
    near = nearest(word, _similar(word, search_path(program)))
    if set(word) & _SPACE:
        fix = f"write a word each, no shell reads it: command: {flow_words(word)}"
    elif (program.cwd / word).is_file():
        fix = f"write ./{word} for the file in {program.cwd}"
    elif near is not None:
        fix = f"did you mean {printable(near)!r}?"
    else:
        fix = "install it, or write its path"
    return problem_at("unknown-command", text, printable(fix), program.command_origin)


def search_path(program: ProgramSpec) -> str:
    """Return the folders in which a program's command is looked for."""
    return program.env.get("PATH", os.environ.get("PATH", os.defpath))


def _similar(word: str, path: str) -> Iterator[str]:
    """Yield the names of executables that may be meant: PATH has thousands, and few look like the word."""
    for folder in path.split(os.pathsep):
        for name in _files(Path(folder)):
            if abs(len(name) - len(word)) <= 2 and set(word[:1] + word[-1:]) & set(name[:1] + name[-1:]):
                yield name


def _files(folder: Path) -> list[str]:
    try:
        return os.listdir(folder)  # noqa: PTH208  # names alone
    except OSError:
        return []
