"""Builds the `ProgramSpec` of each program of a launch file, with its words and its environment as texts."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from busflow.bus import names
from busflow.launchfile.model.description import ProgramSpec
from busflow.launchfile.model.keys import LaunchKeys, NodeKeys, ProgramKeys
from busflow.launchfile.model.placement import MAIN
from busflow.launchfile.model.problems import Problems, key_origin, problem_at
from busflow.launchfile.model.supervision import Supervision
from busflow.launchfile.yaml.value import Value
from busflow.validation.faults import shown


def in_folder(tree: Value, folder: Path) -> Value:
    """Return a flat file with the folder of each of its programs, which is the file's unless the entry says another."""
    for key, program in tree.section("programs").items():
        stated = program.members.get("cwd")
        if stated is not None and isinstance(stated.content, str):
            target = os.path.normpath(folder.absolute() / Path(stated.content).expanduser())
            tree = tree.with_member(("programs", key, "cwd"), Value(target, stated.origin, stated.key))
        elif (command := program.members.get("command")) is not None:  # else the entry changes an included program
            tree = tree.with_member(("programs", key, "cwd"), Value(str(folder.absolute()), command.origin))
    return tree


def programs_of(keys: LaunchKeys, tree: Value, problems: Problems) -> Iterator[ProgramSpec]:
    """Yield the programs without the wrong ones, which are reported."""
    for key, value in tree.section("programs").items():
        stated = keys.programs[key]
        if not stated.when or not _is_named_well(key, value, keys, problems):
            continue
        command = value.members.get("command")
        if stated.command is None or command is None:
            if any(path[-1:] == ("command",) for path in problems.left_out):
                continue  # it is reported as wrong
            message, fix = f"the program {key} has no command", "add its words: command: [ros2, run, cam, node]"
            problems.add(problem_at("missing-command", message, fix, key_origin(value)), left_out=[("programs",)])
            continue
        yield _program(key, value, stated, command)


def _program(key: str, value: Value, stated: ProgramKeys, command: Value) -> ProgramSpec:
    cwd = value.members.get("cwd", command)
    return ProgramSpec(
        name=f"/{key}",
        origin=key_origin(value),
        command=texts(stated.command or ()),
        command_origin=command.origin,
        cwd=Path(str(cwd.content)) if cwd is not command else Path(),
        cwd_origin=cwd.origin,
        env=variables(value.members.get("env", value.without(()))),
        ready=stated.ready,
        grace_s=stated.grace,
        supervision=supervision_of(stated),
        depends_origins={f"/{name}": key_origin(each) for name, each in value.section("depends_on").items()},
        machine=None if stated.machine == MAIN else stated.machine,
    )


def supervision_of(stated: NodeKeys | ProgramKeys) -> Supervision:
    """Return the restart policy and dependencies of a node or program, with the full names of others."""
    needs = {f"/{name}": condition for name, condition in stated.depends_on.items()}
    return Supervision(stated.restart.as_policy(), needs, stated.on_exit)


def _is_named_well(key: str, value: Value, keys: LaunchKeys, problems: Problems) -> bool:
    """Return whether a program has a valid name that nothing else has; report it if not."""
    space, _, name = key.rpartition("/")
    for what, text, fault in (
        ("program name", name, names.node_name_fault(name)),
        ("namespace", f"/{space}", names.namespace_fault(f"/{space}")),
    ):
        if fault is not None:
            message = f"{what} {text!r}: {fault.message}"
            problems.add(problem_at("invalid-name", message, None, key_origin(value)), left_out=[("programs",)])
            return False
    node = keys.nodes.get(key)
    taken = "a node" if node is not None and node.when else "a process" if key in {MAIN, *keys.processes} else ""
    if taken:
        message = f"{key} is the name of {taken} too"
        problems.add(
            problem_at("duplicate-name", message, "rename one of them", key_origin(value)), left_out=[("programs",)]
        )
    return not taken


def variables(env: Value) -> dict[str, str]:
    """Return the environment variables that an `env` section states, all as texts."""
    return {name: _text(each.content) for name, each in env.members.items()}


def texts(words: Iterable[object]) -> tuple[str, ...]:
    """Return the words of a command, all as texts.

    >>> texts(["camera", "--rate", 30, "--crop", True])
    ('camera', '--rate', '30', '--crop', 'true')
    """
    return tuple(map(_text, words))


def _text(value: object) -> str:
    return value if isinstance(value, str) else shown(value)
